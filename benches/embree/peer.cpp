// Traces rays with Embree for the side-by-side benchmark; started, fed and read by `main.rs`.
//
// One command a line on standard input, one answer a line on standard output:
//
//   mesh PATH VERTICES TRIANGLES        mesh INDEX BUILD_SECONDS BVH_BYTES MESH_BYTES
//   rays PATH COUNT                     rays INDEX
//   run MESH RAYS MODE FIRST COUNT      run SECONDS HITS
//   distances RAYS PATH                 distances COUNT
//
// or `error MESSAGE`. A mesh file holds VERTICES times x y z as f32, then TRIANGLES times three u32; a ray file holds COUNT
// times ox oy oz dx dy dz as f32; `distances` writes, as f32, the ray parameter of the nearest hit that the last `run` over
// each ray found, infinity for a miss. MODE is intersect1, intersect16, or coherent16: intersect16 with the flag for
// coherent rays. FIRST is a multiple of 16. All native byte order. One thread.

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

constexpr size_t PACKET = 16;
constexpr int BUILDS = 3;
constexpr float INFINITE = std::numeric_limits<float>::infinity();

// Bytes that Embree holds, by its own account: what its memory monitor is told.
int64_t embree_bytes = 0;

bool count_bytes(void*, ssize_t bytes, bool) {
    embree_bytes += bytes;
    return true;
}

struct Mesh {
    std::vector<float> vertices;
    std::vector<uint32_t> indices;
    RTCScene scene = nullptr;
};

// 16 rays, each component by itself, as rtcIntersect16 takes them.
struct alignas(64) Packet {
    float component[6][PACKET];
};

struct Rays {
    std::vector<float> components;  // six of each ray, for single rays
    std::vector<Packet> packets;    // the same rays, so that neither mode pays for the other's layout
    std::vector<float> distances;
    size_t count = 0;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <typename T>
void read_into(std::ifstream& file, T* to, size_t count) {
    if (!file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * sizeof(T)))) {
        throw std::runtime_error("a file is shorter than announced");
    }
}

std::string add_mesh(RTCDevice device, std::vector<Mesh>& meshes, std::istringstream& arguments) {
    std::string path;
    size_t vertices = 0, triangles = 0;
    arguments >> path >> vertices >> triangles;
    std::ifstream file(path, std::ios::binary);
    meshes.emplace_back();
    Mesh& mesh = meshes.back();
    mesh.vertices.resize(3 * vertices + 1);  // Embree reads 16 bytes at the last vertex
    mesh.indices.resize(3 * triangles);
    read_into(file, mesh.vertices.data(), 3 * vertices);
    read_into(file, mesh.indices.data(), 3 * triangles);

    // the first build of a device starts more than itself: the least time of a few
    double seconds = INFINITE;
    int64_t bytes = 0;
    for (int build = 0; build < BUILDS; build++) {
        if (mesh.scene) {
            rtcReleaseScene(mesh.scene);
        }
        const int64_t before = embree_bytes;
        const auto start = std::chrono::steady_clock::now();
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.vertices.data(), 0,
                                   3 * sizeof(float), vertices);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                                   3 * sizeof(uint32_t), triangles);
        rtcCommitGeometry(geometry);
        mesh.scene = rtcNewScene(device);
        rtcAttachGeometry(mesh.scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(mesh.scene);
        seconds = std::min(seconds, seconds_since(start));
        bytes = embree_bytes - before;
    }
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
        throw std::runtime_error("Embree's error " + std::to_string(error));
    }
    std::ostringstream answer;
    answer << "mesh " << meshes.size() - 1 << ' ' << seconds << ' ' << bytes << ' '
           << 3 * vertices * sizeof(float) + 3 * triangles * sizeof(uint32_t);
    return answer.str();
}

std::string add_rays(std::vector<Rays>& sets, std::istringstream& arguments) {
    std::string path;
    Rays rays;
    arguments >> path >> rays.count;
    std::ifstream file(path, std::ios::binary);
    rays.components.resize(6 * rays.count);
    read_into(file, rays.components.data(), rays.components.size());
    rays.distances.assign(rays.count, INFINITE);
    rays.packets.resize((rays.count + PACKET - 1) / PACKET);
    for (size_t ray = 0; ray < rays.packets.size() * PACKET; ray++) {
        for (size_t i = 0; i < 6; i++) {
            const size_t from = ray < rays.count ? ray : rays.count - 1;
            rays.packets[ray / PACKET].component[i][ray % PACKET] = rays.components[6 * from + i];
        }
    }
    sets.push_back(std::move(rays));
    return "rays " + std::to_string(sets.size() - 1);
}

size_t trace_single(RTCScene scene, Rays& rays, size_t first, size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    size_t hits = 0;
    for (size_t i = first; i < end; i++) {
        const float* ray = &rays.components[6 * i];
        RTCRayHit query;
        query.ray.org_x = ray[0], query.ray.org_y = ray[1], query.ray.org_z = ray[2];
        query.ray.dir_x = ray[3], query.ray.dir_y = ray[4], query.ray.dir_z = ray[5];
        query.ray.tnear = 0.0f, query.ray.tfar = INFINITE;
        query.ray.time = 0.0f, query.ray.mask = ~0u, query.ray.id = 0, query.ray.flags = 0;
        query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &query);
        const bool hit = query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        hits += hit;
        rays.distances[i] = hit ? query.ray.tfar : INFINITE;
    }
    return hits;
}

size_t trace_packets(RTCScene scene, Rays& rays, size_t first, size_t end, bool coherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (coherent) {
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }
    size_t hits = 0;
    for (size_t start = first; start < end; start += PACKET) {
        const Packet& packet = rays.packets[start / PACKET];
        const size_t count = std::min(PACKET, end - start);
        alignas(64) int valid[PACKET];
        RTCRayHit16 query;
        std::memcpy(query.ray.org_x, packet.component[0], sizeof query.ray.org_x);
        std::memcpy(query.ray.org_y, packet.component[1], sizeof query.ray.org_y);
        std::memcpy(query.ray.org_z, packet.component[2], sizeof query.ray.org_z);
        std::memcpy(query.ray.dir_x, packet.component[3], sizeof query.ray.dir_x);
        std::memcpy(query.ray.dir_y, packet.component[4], sizeof query.ray.dir_y);
        std::memcpy(query.ray.dir_z, packet.component[5], sizeof query.ray.dir_z);
        for (size_t i = 0; i < PACKET; i++) {
            valid[i] = i < count ? -1 : 0;
            query.ray.tnear[i] = 0.0f, query.ray.tfar[i] = INFINITE;
            query.ray.time[i] = 0.0f, query.ray.mask[i] = ~0u, query.ray.id[i] = 0, query.ray.flags[i] = 0;
            query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
        rtcIntersect16(valid, scene, &context, &query);
        for (size_t i = 0; i < count; i++) {
            const bool hit = query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
            hits += hit;
            rays.distances[start + i] = hit ? query.ray.tfar[i] : INFINITE;
        }
    }
    return hits;
}

std::string run(const std::vector<Mesh>& meshes, std::vector<Rays>& sets, std::istringstream& arguments) {
    size_t mesh = 0, set = 0, first = 0, count = 0;
    std::string mode;
    arguments >> mesh >> set >> mode >> first >> count;
    Rays& rays = sets.at(set);
    const RTCScene scene = meshes.at(mesh).scene;
    const size_t end = std::min(first + count, rays.count);
    if (first % PACKET != 0) {
        throw std::runtime_error("the first ray does not begin a packet");
    }
    if (mode != "intersect1" && mode != "intersect16" && mode != "coherent16") {
        throw std::runtime_error("unknown mode " + mode);
    }
    const auto start = std::chrono::steady_clock::now();
    const size_t hits = mode == "intersect1" ? trace_single(scene, rays, first, end)
                                             : trace_packets(scene, rays, first, end, mode == "coherent16");
    const double seconds = seconds_since(start);
    std::ostringstream answer;
    answer.precision(9);
    answer << "run " << seconds << ' ' << hits;
    return answer.str();
}

std::string write_distances(const std::vector<Rays>& sets, std::istringstream& arguments) {
    size_t set = 0;
    std::string path;
    arguments >> set >> path;
    const std::vector<float>& distances = sets.at(set).distances;
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(distances.data()),
               static_cast<std::streamsize>(distances.size() * sizeof(float)));
    if (!file.flush()) {
        throw std::runtime_error("cannot write " + path);
    }
    return "distances " + std::to_string(distances.size());
}

}  // namespace

int main() {
    // as Embree's documentation advises
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    RTCDevice device = rtcNewDevice("threads=1");
    if (!device) {
        std::cout << "error Embree gives no device" << std::endl;
        return 1;
    }
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, nullptr);
    const auto version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
    std::cout << "embree " << version / 10000 << '.' << version / 100 % 100 << '.' << version % 100
              << (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)
                      ? ", packets of 16 native (AVX-512)"
                      : ", packets of 16 in parts (no AVX-512)")
              << std::endl;

    std::vector<Mesh> meshes;
    std::vector<Rays> sets;
    meshes.reserve(64);
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream arguments(line);
        std::string command;
        arguments >> command;
        try {
            std::string answer;
            if (command == "mesh") {
                answer = add_mesh(device, meshes, arguments);
            } else if (command == "rays") {
                answer = add_rays(sets, arguments);
            } else if (command == "run") {
                answer = run(meshes, sets, arguments);
            } else if (command == "distances") {
                answer = write_distances(sets, arguments);
            } else {
                answer = "error unknown command " + command;
            }
            std::cout << answer << std::endl;
        } catch (const std::exception& error) {
            std::cout << "error " << error.what() << std::endl;
        }
    }
    for (Mesh& mesh : meshes) {
        rtcReleaseScene(mesh.scene);
    }
    rtcReleaseDevice(device);
    return 0;
}
