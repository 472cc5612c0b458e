"""The same picture by Mitsuba 3: mean radiance, every pixel by a z-test, depths, positions and normals.

    python mitsuba_peer.py SCENE...

The deformed objects go to Mitsuba as dense tessellations with vertices from SciPy (deformed.py); camera, film, lights and
materials are taken from the scene file by this script's own reading of it. Both programs render the same picture with
independent random numbers.

*   Mean radiance: each colour's mean over the picture within 0.3 % or 3 standard deviations.
*   z-test, as in Mitsuba's own tests: for every pixel and colour the difference over its standard deviation, by both
    programs' measured variances, must be below the value that chance exceeds in 1 of 100 whole pictures (Šidák);
    at least 99.75 % of them must pass.
*   Depth: the point that trimray reports for a pixel must lie in the pixel as Mitsuba's camera sees it, and a ray of
    Mitsuba to it must hit at the same depth, and so at the same point, to 1e-5. Two exceptions: at a grazing angle the
    distance square to the surface must be within the tessellation's error, and where the ray passes a silhouette a ray
    beside it must agree.
*   Normal: where the depths agree, the normal that trimray reports must be that of SciPy's volume at the undeformed place
    of the point that Mitsuba hits, to 1e-5 for half of the pixels, and for all to that and
    what the tessellation's error, by moving the point along the curved surface, makes of it.
"""

import re
import sys
import tempfile
import tomllib
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
from deformed import fail_unless, load_objects, placement, tessellate, trimray
from scipy.special import erfc

# 32-bit floats, one ray at a time: needs nothing that is not in the package.
mi.set_variant("scalar_rgb")

SIZE = (120, 90)
SPP = 512
# Mitsuba's samples are taken in this many pictures, whose spread gives the variance.
SEEDS = 32
MAX_DEPTH = 6

# Small triangles of a scene, about.
TRIANGLES = 3_000_000

# Chance for one whole picture to fail a pixel's test if both programs compute the same.
SIGNIFICANCE = 0.01
SHARE = 0.9975

DEPTH = 1e-5
NORMAL = 1e-5

# Step of the differences that give a normal, in parts of a triangle.
STEP = 1e-5

# Greatest curvature of the surfaces that are checked, over one over the object's diagonal.
CURVATURE = 10

# Where a ray is moved at silhouettes.
SIDES = np.concatenate([np.eye(3), -np.eye(3)])


def transform(steps):
    """A list of transform steps as Mitsuba's transform."""
    return mi.ScalarTransform4f(placement(steps))


def light(entry):
    """A light of the scene file as Mitsuba's plugin."""
    radiance = {"type": "rgb", "value": entry["radiance"]}
    if entry["type"] == "constant":
        return {"type": "constant", "radiance": radiance}
    fail_unless(entry["type"] == "area" and entry["shape"] == "rectangle", "a light is not known to this check")
    emitter = {"type": "area", "radiance": radiance}
    return {"type": "rectangle", "to_world": transform(entry.get("to_world", [])), "emitter": emitter}


def mesh(name, vertices, indices, reflectance):
    """A mesh with its own two-sided diffuse material and the triangles' own normals."""
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict({"type": "twosided", "nested": diffuse})
    properties["face_normals"] = True
    made = mi.Mesh(name, len(vertices), len(indices), props=properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = np.ascontiguousarray(vertices, np.float32).ravel()
    parameters["faces"] = np.ascontiguousarray(indices, np.uint32).ravel()
    parameters.update()
    return made


def sensor(description):
    """The scene file's camera and a film of this check's size."""
    camera = description["camera"]
    fail_unless(camera.get("aperture_radius", 0) == 0, "a thin lens is not known to this check")
    to_world = mi.ScalarTransform4f().look_at(
        origin=camera["origin"], target=camera["target"], up=camera.get("up", [0, 0, 1])
    )
    return {
        "type": "perspective",
        "fov": camera["fov"],
        "fov_axis": camera.get("fov_axis", "x"),
        "to_world": to_world,
        "film": {
            "type": "hdrfilm",
            "width": SIZE[0],
            "height": SIZE[1],
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": "independent", "sample_count": SPP},
    }


def mitsuba_scene(scene, description):
    """The scene for Mitsuba, and its objects with their tessellations."""
    objects = load_objects(scene)
    count = sum(len(target.triangles) for target in objects if target.volumes)
    n = max(1, int(np.sqrt(TRIANGLES / count)))
    materials = {entry["name"]: entry for entry in description["material"]}
    contents = {"type": "scene", "sensor": sensor(description)}
    contents["integrator"] = {"type": "path", "max_depth": MAX_DEPTH}
    for number, entry in enumerate(description["light"]):
        contents[f"light{number}"] = light(entry)
    parts = []
    for target, entry in zip(objects, description["object"], strict=True):
        material = materials[entry["material"]]
        fail_unless(material["type"] == "diffuse", "a material is not known to this check")
        part = tessellate(target, n)
        parts.append((target, part))
        contents[f"object_{target.name}"] = mesh(
            target.name, part.vertices, part.indices, material.get("reflectance", [0.5] * 3)
        )
    return mi.load_dict(contents), parts


def render_mitsuba(scene):
    """Radiance and the variance of its mean, (h, w, 3) each, from pictures with different random numbers."""
    pictures = np.array([np.array(mi.render(scene, spp=SPP // SEEDS, seed=seed), float) for seed in range(SEEDS)])
    return pictures.mean(0), pictures.var(0, ddof=1) / SEEDS


def render_trimray(scene):
    """trimray's channels {name: (h, w)}; the scene's copy asks for the AOVs needed here."""
    scene = Path(scene)
    text = scene.read_text(encoding="utf-8").replace('"meshes/', f'"{scene.parent.resolve()}/meshes/')
    text = re.sub(r"(?m)^aovs = .*\n", "", text)
    text, count = re.subn(r"(?m)^\[render\]\n", '[render]\naovs = ["variance", "depth", "position", "geo_normal"]\n', text)
    fail_unless(count == 1, "the scene has one [render] table")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scene.toml").write_text(text, encoding="utf-8")
        output = Path(folder) / "out.exr"
        size = "x".join(map(str, SIZE))
        flags = ["--size", size, "--spp", SPP, "--max-depth", MAX_DEPTH, "--seed", 77, "--quiet"]
        trimray("render", Path(folder) / "scene.toml", "-o", output, *flags)
        file = oiio.ImageInput.open(str(output))
        spec = file.spec()
        pixels = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT).astype(float)
        file.close()
    return {name: pixels[:, :, index] for index, name in enumerate(spec.channelnames)}


def compare_means(ours, our_variance, theirs, their_variance):
    """Each colour's mean over the picture."""
    relative = ours.mean((0, 1)) / theirs.mean((0, 1)) - 1
    pixels = ours.shape[0] * ours.shape[1]
    deviation = np.sqrt((our_variance + their_variance).sum((0, 1))) / pixels / theirs.mean((0, 1))
    sigmas = relative / deviation
    print(f"  mean radiance {theirs.mean((0, 1)).round(5)}: off by {(100 * relative).round(4)} %, {sigmas.round(2)} sigma")
    return bool(((np.abs(relative) <= 0.003) | (np.abs(sigmas) <= 3)).all())


def compare_pixels(ours, our_variance, theirs, their_variance):
    """Every pixel and colour by the z-test."""
    difference = np.abs(ours - theirs)
    variance = our_variance + their_variance
    # pixels that see a light or the background alone have no noise: only rounding is between the two
    noisy = variance > 1e-12 * theirs**2
    fail_unless((difference[~noisy] <= 1e-5 * np.abs(theirs[~noisy])).all(), "pixels without noise are equal")
    chance = erfc(np.sqrt(difference[noisy] ** 2 / variance[noisy] / 2))
    bound = 1 - (1 - SIGNIFICANCE) ** (1 / max(1, noisy.sum()))
    passed = (chance > bound).mean()
    z = (ours - theirs)[noisy] / np.sqrt(variance[noisy])
    print(f"  z-test of {noisy.sum()} values: {100 * passed:.3f} % pass, largest |z| {np.abs(z).max():.2f},", end=" ")
    print(f"mean z {z.mean():+.4f}, standard deviation {z.std():.4f}")
    return passed >= SHARE


def compare_depths(scene, channels, parts):
    """trimray's points and normals through Mitsuba's camera and triangles; returns whether all agree."""
    deviation = max(part.deviation for _, part in parts)
    camera = scene.sensors()[0]
    width, height = SIZE
    position = np.stack([channels[f"position.{axis}"] for axis in "XYZ"], axis=-1)
    depth = channels["depth.T"]
    to_world = np.array(camera.world_transform().matrix, float).reshape(4, 4)
    origin = to_world[:3, 3]
    ahead = to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])

    def through(x, y):
        """Where the ray through a place of the picture, [0, 1]², meets the plane at distance 1."""
        direction = np.array(camera.sample_ray(0, 0, [x, y], [0, 0])[0].d, float)
        return direction / (direction @ ahead)

    # three corners of the picture give the map from directions to pixels
    low, right, down = through(0, 0), through(1, 0), through(0, 1)
    to_picture = np.linalg.inv(np.stack([right - low, down - low, low], axis=1))

    outside, grazing, silhouettes, wrong, worst, hits = 0, 0, 0, 0, 0.0, 0
    agreeing = []
    for y in range(height):
        for x in range(width):
            if depth[y, x] == 0:
                continue
            hits += 1
            towards = position[y, x] - origin
            a, b, c = to_picture @ towards
            u, v = a / c * width, b / c * height
            # the camera's single precision, in pixels
            margin = 1e-3
            if not (x - margin <= u <= x + 1 + margin and y - margin <= v <= y + 1 + margin):
                outside += 1
            distance = np.linalg.norm(towards)
            single = 2e-6 * distance
            found, cosine, place = first_hit(scene, origin, towards / distance)
            error = max(abs(found / depth[y, x] - 1), abs(found / distance - 1))
            if error <= DEPTH:
                worst = max(worst, error)
                if place[0] is not None:
                    agreeing.append((*place, y, x, cosine))
                continue
            if error * distance * cosine <= deviation + single:
                grazing += 1
                continue
            step = 4 * deviation + single
            beside = [first_hit(scene, origin, (towards + step * side) / distance)[0] for side in SIDES]
            if min(abs(t / depth[y, x] - 1) for t in beside) <= DEPTH:
                silhouettes += 1
            else:
                wrong += 1
    print(f"  depth of {hits} pixels: within {worst:.1e}, {grazing} grazing, {silhouettes} at silhouettes, {wrong} WRONG;", end=" ")
    print(f"{outside} points outside of their pixel")
    fail_unless(hits > width * height // 4, "too few hits for the check to mean something")
    normal = np.stack([channels[f"geo_normal.{axis}"] for axis in "XYZ"], axis=-1)
    return compare_normals(parts, agreeing, normal) and wrong == 0 and outside == 0


def exact_normals(target, triangle, weights):
    """Unit normals at points of undeformed triangles (N,), from differences of the deformed place towards the corners."""
    corners = target.triangles[triangle]
    rest = target.at(triangle, weights)
    # the two corners that the point is not nearest to: the differences stay within the triangle, and so within its box
    nearest = weights.argmax(1)
    sides = []
    for turn in (1, 2):
        towards = corners[np.arange(len(triangle)), (nearest + turn) % 3] - rest
        near, far = (target.deform(rest + step * STEP * towards) for step in (1, 2))
        sides.append(4 * near - far - 3 * target.deform(rest))
    normals = np.cross(*sides)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def compare_normals(parts, agreeing, normal):
    """trimray's normals where Mitsuba's rays hit (shape, small triangle, barycentric u and v, y, x, cosine)."""
    agrees, count = True, 0
    for target, part in parts:
        chosen = [entry[1:] for entry in agreeing if entry[0] == f"object_{target.name}"]
        if not chosen:
            continue
        index, u, v, y, x, cosine = (np.array(column) for column in zip(*chosen, strict=True))
        corners = part.corner_weights[part.small[index % part.triangles_per_triangle]]
        weights = np.einsum("nk,nkc->nc", np.stack([1 - u - v, u, v], axis=1), corners)
        exact = exact_normals(target, index // part.triangles_per_triangle, weights)
        ours = normal[y, x]
        error = np.linalg.norm(ours - exact, axis=1)
        # the error of the triangles moves the hit along the surface, and with it the normal
        bound = NORMAL + CURVATURE * part.deviation / cosine / target.diagonal
        wrong = int((error > bound).sum())
        agrees = agrees and wrong == 0 and np.median(error) <= NORMAL
        count += len(error)
        print(f"  normals of {target.name}: {len(error)} pixels, median {np.median(error):.1e},", end=" ")
        print(f"at most {error.max():.1e}, {wrong} WRONG")
    fail_unless(count > 0, "no normals to compare")
    return bool(agrees)


def first_hit(scene, origin, direction):
    """Distance to the first surface of Mitsuba's scene (inf), the cosine between ray and normal there, and the place.

    The place is the shape's name in Mitsuba, the triangle's number, and the barycentric weights of its last two corners.
    """
    found = scene.ray_intersect(mi.Ray3f(o=mi.Point3f(*origin), d=mi.Vector3f(*direction)))
    if not found.is_valid():
        return np.inf, 1.0, (None, 0, 0.0, 0.0)
    name = found.shape.id() if found.shape.is_mesh() else None
    # without texture coordinates Mitsuba gives the barycentric ones
    return found.t, abs(np.array(found.n, float) @ direction), (name, found.prim_index, found.uv[0], found.uv[1])


def check(path):
    """Compares one scene; returns whether all checks pass."""
    description = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    scene, parts = mitsuba_scene(path, description)
    deviation = max(part.deviation for _, part in parts)
    print(f"{Path(path).name}, {SIZE[0]}x{SIZE[1]}, {SPP} samples, tessellation off by {deviation:.1e}:")
    theirs, their_variance = render_mitsuba(scene)
    channels = render_trimray(path)
    ours = np.stack([channels[c] for c in "RGB"], axis=-1)
    our_variance = np.stack([channels[f"variance.{c}"] for c in "RGB"], axis=-1)
    results = [
        compare_means(ours, our_variance, theirs, their_variance),
        compare_pixels(ours, our_variance, theirs, their_variance),
        compare_depths(scene, channels, parts),
    ]
    return all(results)


def main():
    """Checks the scenes named on the command line."""
    fail_unless(len(sys.argv) > 1, "name the scenes to check")
    results = {path: check(path) for path in sys.argv[1:]}
    for path, passed in results.items():
        fail_unless(passed, f"{path}: not the picture that Mitsuba renders")


if __name__ == "__main__":
    main()
