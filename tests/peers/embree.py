"""Closest hits against Embree on a dense tessellation of the same deformed objects.

    python embree.py SCENE...

Embree sees flat triangles in single precision, trimray the exact surface in double: they must agree up to the
tessellation's error, and every ray on which they do not must be explained. For each scene:

1.  Every object is cut into n² triangles for each of its own, with vertices from SciPy (deformed.py). E is the measured
    distance between these triangles and the exact surface, plus what single precision adds.
2.  All rays go through both. A ray agrees if both miss, or both hit with |t difference| <= 2 E.
3.  Every other ray is taken apart, without trimray's code:
    *   trimray's hit is checked to be a point of the exact surface (SciPy) on the ray, inside a triangle of the input.
        So where Embree reports nothing or something behind it, Embree's triangles have let the ray through.
    *   Where Embree's hit comes first, the exact surface near that place is searched for a crossing with the ray. It
        must have none before trimray's, and must pass the ray at a distance of at most 2 E.
    *   The disagreement must vanish when the ray is moved sideways by at most MOVED times E: through trimray's answer
        moving over to Embree's side, or the other way round.
    A ray for which one of these fails is UNEXPLAINED, and fails the check.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from deformed import fail_unless, load_objects, tessellate, trimray
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

# Rays of each kind for each scene.
CHORDS, CAMERA = 60_000, 40_000

# Small triangles of a scene, about: error 1e-6 of the diagonal needs a few million.
TRIANGLES = 3_000_000

# Roundings of single precision between a vertex and Embree's t, in parts of the ray's origin and reach: vertices are
# rounded once, the differences and products of the intersection a few times more.
ROUNDINGS = 8

# A hit of trimray must lie on the ray and on SciPy's surface to this, in parts of the diagonal.
EXACT = 1e-10

# A crossing of the exact surface is told from a near miss at this distance from the ray, in parts of the diagonal.
CROSSING = 1e-12

# Rays on which the two differ are moved sideways by up to this many E. A flat triangle that is E off the surface moves
# the silhouette by E; the corner between two, seen along an edge, by a few.
MOVED = np.array([1.0, 2.0, 4.0])


def sphere_around(points):
    """Centre and radius of a sphere around points."""
    low, high = points.min(0), points.max(0)
    centre = (low + high) / 2
    return centre, np.linalg.norm(points - centre, axis=1).max()


def directions(random, count):
    """Uniform unit vectors (count, 3)."""
    vectors = random.standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def make_rays(random, centre, radius):
    """Chords of a sphere between uniform points of it, and rays from a few places around into it.

    Origins and directions are rounded to single precision, so that both programs trace the same rays.
    """
    start, end = (centre + radius * directions(random, CHORDS) for _ in range(2))
    places = centre + 3 * radius * directions(random, 8)
    origin = np.repeat(places, CAMERA // 8, axis=0)
    target = centre + radius * 0.8 * random.uniform(-1, 1, origin.shape)
    rays = np.concatenate([np.concatenate([start, origin]), np.concatenate([end - start, target - origin])], axis=1)
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    return rays.astype(np.float32).astype(np.float64)


def trace(scene, rays):
    """trimray's closest hits."""
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "rays.npy", rays)
        trimray("trace", scene, "--rays", Path(folder) / "rays.npy", "-o", Path(folder) / "hits.npz")
        with np.load(Path(folder) / "hits.npz") as hits:
            return dict(hits)


class Embree:
    """The tessellated objects in Embree."""

    def __init__(self, objects):
        self.objects = objects
        count = sum(len(target.triangles) for target in objects if target.volumes)
        n = max(1, int(np.sqrt(TRIANGLES / count)))
        self.parts = [tessellate(target, n) for target in objects]
        self.firsts = np.cumsum([0] + [len(part.indices) for part in self.parts])
        offsets = np.cumsum([0] + [len(part.vertices) for part in self.parts])
        vertices = np.concatenate([part.vertices for part in self.parts])
        indices = np.concatenate([part.indices + at for part, at in zip(self.parts, offsets, strict=False)])
        self.scene = EmbreeScene(robust=True)
        TriangleMesh(self.scene, vertices.astype(np.float32), indices.astype(np.int32))
        self.vertices, self.indices = vertices, indices
        self.deviation = max(part.deviation for part in self.parts)

    def trace(self, rays):
        """t (inf for a miss) and the number of the small triangle (-1)."""
        found = self.scene.run(
            np.ascontiguousarray(rays[:, :3], np.float32), np.ascontiguousarray(rays[:, 3:], np.float32), output=True
        )
        hit = found["primID"] >= 0
        return np.where(hit, found["tfar"].astype(float), np.inf), found["primID"]

    def rest(self, small, points):
        """Object, its triangle, and the undeformed barycentric weights for points on small triangles."""
        which = np.searchsorted(self.firsts, small, side="right") - 1
        triangle = np.empty(len(small), int)
        weights = np.empty((len(small), 3))
        for number, part in enumerate(self.parts):
            mine = which == number
            local = small[mine] - self.firsts[number]
            triangle[mine] = local // part.triangles_per_triangle
            corner_weights = part.corner_weights[part.small[local % part.triangles_per_triangle]]
            corners = self.vertices[self.indices[small[mine]]]
            inner = barycentric(corners, points[mine])
            weights[mine] = np.einsum("nc,ncw->nw", inner, corner_weights)
        return which, triangle, weights


def barycentric(corners, points):
    """Barycentric weights (N, 3) of points (N, 3) in the planes of triangles (N, 3, 3)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb = (a * a).sum(1), (a * b).sum(1), (b * b).sum(1)
    pa, pb = (p * a).sum(1), (p * b).sum(1)
    det = aa * bb - ab * ab
    u, v = (bb * pa - ab * pb) / det, (aa * pb - ab * pa) / det
    return np.stack([1 - u - v, u, v], axis=1)


def across(rays):
    """Two unit vectors (N, 2, 3) square to each ray."""
    direction = rays[:, 3:] / np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(direction).argmin(1)]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(direction, first)], axis=1)


def on_exact_surface(objects, rays, hits):
    """For rays that trimray hits: distance of its hit from the ray, from SciPy's surface, and from the input's faces."""
    t = hits["t"]
    off = np.linalg.norm(rays[:, :3] + t[:, None] * rays[:, 3:] - hits["position"], axis=1)
    for number, target in enumerate(objects):
        mine = hits["object"] == number
        if not mine.any():
            continue
        rest = hits["rest"][mine]
        off[mine] = np.maximum(off[mine], np.linalg.norm(target.deform(rest) - hits["position"][mine], axis=1))
        corners, face_of = target.triangles, target.fanned[1]
        outside = np.full(len(rest), np.inf)
        for ray, face in enumerate(hits["face"][mine]):
            own = corners[face_of == face]
            point = np.broadcast_to(rest[ray], (len(own), 3))
            weights = barycentric(own, point)
            nearest = np.einsum("nij,ni->nj", own, np.clip(weights, 0, 1) / np.clip(weights, 0, 1).sum(1)[:, None])
            outside[ray] = np.linalg.norm(nearest - point, axis=1).min()
        off[mine] = np.maximum(off[mine], outside)
    return off


def nearest_passes(target, triangle, start, rays, size):
    """Where the exact image of one triangle of an object comes closest to rays, near given places.

    A search on shrinking grids of barycentric places around `start` (N, 3), of the first reach `size` (N,), then
    Newton's method where a crossing is near. Returns the distance from the ray (N,) and t there (N,).
    """
    frame = across(rays)
    length = np.linalg.norm(rays[:, 3:], axis=1)

    def seen(weights):
        rest = np.einsum("ngi,nij->ngj", weights, target.triangles[triangle])
        place = target.deform(rest.reshape(-1, 3)).reshape(rest.shape) - rays[:, None, :3]
        return np.einsum("ngj,nkj->ngk", place, frame), np.einsum("ngj,nj->ng", place, rays[:, 3:]) / length[:, None] ** 2

    def inside(uv):
        uv = np.clip(uv, 0, 1)
        over = np.maximum(uv.sum(-1, keepdims=True), 1)
        return uv / over

    def full(uv):
        return np.concatenate([1 - uv.sum(-1, keepdims=True), uv], axis=-1)

    steps = np.linspace(-1, 1, 13)
    pattern = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    best = inside(start[:, 1:])
    reach = np.array(size, float)
    for _ in range(24):
        places = inside(best[:, None, :] + reach[:, None, None] * pattern)
        offset, _ = seen(full(places))
        choice = np.linalg.norm(offset, axis=2).argmin(1)
        best = places[np.arange(len(best)), choice]
        reach = reach * 0.4
    for _ in range(6):
        h = 1e-7
        probes = np.stack([best, best + [h, 0], best - [h, 0], best + [0, h], best - [0, h]], axis=1)
        offset, _ = seen(full(probes))
        jacobian = np.stack([offset[:, 1] - offset[:, 2], offset[:, 3] - offset[:, 4]], axis=2) / (2 * h)
        solvable = np.abs(np.linalg.det(jacobian)) > 1e-14
        step = np.zeros_like(best)
        step[solvable] = np.linalg.solve(jacobian[solvable], -offset[solvable, 0, :, None])[..., 0]
        moved = inside(best + np.clip(step, -1e-3, 1e-3))
        better = np.linalg.norm(seen(full(moved[:, None]))[0][:, 0], axis=1) < np.linalg.norm(offset[:, 0], axis=1)
        best[better] = moved[better]
    offset, t = seen(full(best[:, None]))
    return np.linalg.norm(offset[:, 0], axis=1), t[:, 0]


def crossings_near(embree, rays, t, small):
    """Where the exact surface passes the rays near Embree's hits.

    Searched in the triangle of each hit, and in those of the same object that share a corner with it and are near.
    Returns runs of passes: index of the ray, distance from it, t.
    """
    points = rays[:, :3] + t[:, None] * rays[:, 3:]
    which, triangle, weights = embree.rest(small, points)
    results = []
    for number, target in enumerate(embree.objects):
        mine = np.flatnonzero(which == number)
        shared = {}
        for index, corners in enumerate(target.triangles):
            for corner in corners:
                shared.setdefault(tuple(corner), []).append(index)
        ray, near, start, size = [], [], [], []
        reach = 4 / embree.parts[number].n
        for i in mine:
            rest = weights[i] @ target.triangles[triangle[i]]
            others = {o for corner in target.triangles[triangle[i]] for o in shared[tuple(corner)]}
            for other in sorted(others):
                place = barycentric(target.triangles[[other]], rest[None])[0]
                if other == triangle[i] or place.min() > -reach:
                    ray.append(i)
                    near.append(other)
                    start.append(place)
                    size.append(reach)
        if ray:
            distance, at = nearest_passes(target, np.array(near), np.array(start), rays[ray], np.array(size))
            results.append((np.array(ray), distance, at))
    return results


def explain(scene, embree, rays, hits, other_t, small, allowed):
    """Whether each differing ray is explained (N,), and what it is (N,): which side saw a surface first."""
    diagonal = max(target.diagonal for target in embree.objects if target.volumes)
    t = hits["t"]
    good = np.ones(len(rays), bool)
    hit = np.isfinite(t)
    off = np.zeros(len(rays))
    off[hit] = on_exact_surface(embree.objects, rays[hit], {key: value[hit] for key, value in hits.items()})
    scale = diagonal + np.where(hit, np.abs(t), 0)
    good &= off <= EXACT * scale

    first = other_t < t
    if first.any():
        mine = np.flatnonzero(first)
        nearest = np.full(len(mine), np.inf)
        for ray, distance, at in crossings_near(embree, rays[mine], other_t[mine], small[mine]):
            before = at < t[mine][ray] - EXACT * scale[mine][ray]
            missed = (distance <= CROSSING * diagonal) & before & (at > 0)
            good[mine[ray[missed]]] = False
            np.minimum.at(nearest, ray, distance)
        good[mine] &= nearest <= 2 * allowed[mine]

    flips = np.zeros(len(rays), bool)
    frame = across(rays)
    for moved in MOVED:
        for angle in np.arange(8) * np.pi / 4:
            side = np.cos(angle) * frame[:, 0] + np.sin(angle) * frame[:, 1]
            shifted = rays.copy()
            shifted[:, :3] += moved * allowed[:, None] * side
            shifted = shifted.astype(np.float32).astype(np.float64)
            flips |= closer(trace(scene, shifted)["t"], other_t, t)
            flips |= closer(embree.trace(shifted)[0], t, other_t)
    return good & flips, np.where(first, "Embree first", "trimray first")


def closer(moved, wanted, unwanted):
    """Whether the moved ray's t is nearer to one value than to another; inf is nearest to inf."""
    with np.errstate(invalid="ignore"):
        to_wanted = np.where(np.isinf(moved) & np.isinf(wanted), 0, np.abs(moved - wanted))
        to_unwanted = np.where(np.isinf(moved) & np.isinf(unwanted), 0, np.abs(moved - unwanted))
    return to_wanted < to_unwanted


def check(scene):
    """Compares one scene; returns the number of rays that stay unexplained."""
    started = time.perf_counter()
    objects = load_objects(scene)
    embree = Embree(objects)
    deformed = [part.vertices for part, target in zip(embree.parts, objects, strict=True) if target.volumes]
    centre, radius = sphere_around(np.concatenate(deformed))
    diagonal = max(target.diagonal for target in objects if target.volumes)
    rays = make_rays(np.random.default_rng(3), centre, radius)
    hits = trace(scene, rays)
    t = hits["t"]
    other_t, small = embree.trace(rays)

    reach = np.where(np.isfinite(other_t), other_t, np.where(np.isfinite(t), t, radius))
    single = ROUNDINGS * 2.0**-24 * (np.linalg.norm(rays[:, :3], axis=1) + reach)
    allowed = embree.deviation + single
    both, neither = np.isfinite(t) & np.isfinite(other_t), np.isinf(t) & np.isinf(other_t)
    apart = np.abs(np.where(both, t, 0) - np.where(both, other_t, 0))
    agree = neither | both & (apart <= 2 * allowed)
    odd = np.flatnonzero(~agree)

    corners = embree.vertices[embree.indices[small[both & agree]]]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    same_object = embree.rest(small[both & agree], corners.mean(1))[0] == hits["object"][both & agree]
    between = np.linalg.norm(np.cross(flat, hits["normal"][both & agree]), axis=1)
    angle = np.degrees(np.arcsin(np.clip(between[same_object], 0, 1)))

    explained, kind = np.ones(0, bool), np.zeros(0, str)
    if len(odd):
        chosen = {key: value[odd] for key, value in hits.items()}
        explained, kind = explain(scene, embree, rays[odd], chosen, other_t[odd], small[odd], allowed[odd])
    unexplained = int((~explained).sum())
    print(f"{Path(scene).name}: {len(embree.indices)} triangles (n = {max(part.n for part in embree.parts)}),", end=" ")
    print(f"tessellation off by {embree.deviation / diagonal:.1e}, single precision {single.max() / diagonal:.1e} of the diagonal")
    print(f"  rays {len(rays)}, both hit {both.sum()}, both miss {neither.sum()}, differing {len(odd)}:", end=" ")
    one_hits = np.isfinite(t[odd]) != np.isfinite(other_t[odd])
    print(f"{one_hits.sum()} in hit or miss, {len(odd) - one_hits.sum()} in t;", end=" ")
    firsts = ", ".join(f"{(kind == name).sum()} {name}" for name in ("trimray first", "Embree first"))
    print(f"{firsts}; explained {explained.sum()}, UNEXPLAINED {unexplained}")
    agreed = apart[both & agree].max() / diagonal
    print(f"  where they agree: |t difference| <= {agreed:.1e} of the diagonal, normals within {angle.max():.2f} degrees", end=" ")
    print(f"(median {np.median(angle):.4f}); {time.perf_counter() - started:.0f} s")
    for ray in odd[~explained][:5]:
        print(f"  UNEXPLAINED ray {rays[ray].tolist()}: t {t[ray]!r}, Embree {other_t[ray]!r}")
    fail_unless(both.sum() > len(rays) // 20, "too few rays hit for the check to mean something")
    return unexplained


def main():
    """Checks the scenes named on the command line."""
    fail_unless(len(sys.argv) > 1, "name the scenes to check")
    unexplained = sum(check(scene) for scene in sys.argv[1:])
    fail_unless(unexplained == 0, f"{unexplained} rays differ from Embree without an explanation")


if __name__ == "__main__":
    main()
