"""The deformed surface evaluated without trimray's code: scene, mesh and volume in NumPy and SciPy.

Shared by the cross-checks beside it. From trimray comes only the list of control points (`trimray export`), for they
are the result of the scene's edits; knots, basis functions, placement of the mesh and tessellation are done here.
Run as a program it compares every exported patch with the volume:

    python deformed.py SCENE...
"""

import json
import os
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np
from scipy.interpolate import BSpline

ROOT = Path(__file__).resolve().parents[2]

# Points evaluated at once: a chunk's gathered control points stay below 200 MB.
CHUNK = 100_000

# Points this close to a lattice's box are in it, in parts of its diagonal: far above the rounding of points that are
# meant to lie on its faces, far below any tolerance asked here.
ON_BOX = 1e-13


def binary():
    """Path of the release build that is checked."""
    named = os.environ.get("TRIMRAY")
    if named:
        return Path(named)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return target / "release" / "trimray"


def trimray(*arguments):
    """Runs the program; returns what it prints to stdout."""
    command = [str(binary()), *map(str, arguments)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: exit {done.returncode}\n{done.stderr}")
    return done.stdout


def fail_unless(condition, message):
    """Ends the program with a message unless the condition holds."""
    if not condition:
        raise SystemExit(f"FAILED: {message}")


# ---------------------------------------------------------------------------------------------- mesh and placement


def read_obj(path):
    """Positions (V, 3) and faces (lists of 0-based indices) of an OBJ file."""
    positions, faces = [], []
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            indices = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([i - 1 if i > 0 else len(positions) + i for i in indices])
    return np.array(positions), faces


def placement(steps):
    """The 4x4 matrix of a list of transform steps, the first applied first."""
    matrix = np.eye(4)
    for step in steps:
        ((kind, value),) = step.items()
        one = np.eye(4)
        if kind == "scale":
            one[:3, :3] = np.diag(np.broadcast_to(value, 3))
        elif kind == "translate":
            one[:3, 3] = value
        elif kind == "rotate":
            axis = np.array(value["axis"], float)
            x, y, z = axis / np.linalg.norm(axis)
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            angle = np.radians(value["angle"])
            one[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        else:
            raise SystemExit(f"transform step {kind} is not known to this check")
        matrix = one @ matrix
    return matrix


def fan(positions, faces):
    """Triangles (T, 3, 3) of convex faces and the face of each (T,); a face that is not convex is an error."""
    corners, face_of = [], []
    for face, indices in enumerate(faces):
        polygon = positions[indices]
        turns = np.cross(polygon - np.roll(polygon, 1, 0), np.roll(polygon, -1, 0) - polygon)
        fail_unless((turns @ turns.sum(0) > 0).all(), f"face {face} is not convex: not known to this check")
        for i in range(1, len(indices) - 1):
            corners.append(polygon[[0, i, i + 1]])
            face_of.append(face)
    return np.array(corners), np.array(face_of)


# ------------------------------------------------------------------------------------------------------- the volume


@dataclass
class Volume:
    """A clamped uniform B-spline volume over a box, with control points (nx, ny, nz, 4): x y z and the weight."""

    degree: list
    bounds: np.ndarray
    control_points: np.ndarray

    def __post_init__(self):
        self.knots = []
        for axis in range(3):
            k, n = self.degree[axis], self.control_points.shape[axis]
            low, high = self.bounds[:, axis]
            inner = low + (high - low) * np.arange(1, n - k) / (n - k)
            self.knots.append(np.concatenate([[low] * (k + 1), inner, [high] * (k + 1)]))
        weight = self.control_points[..., 3:]
        self.homogeneous = np.concatenate([self.control_points[..., :3] * weight, weight], axis=-1)

    @classmethod
    def exported(cls, data):
        """The volume that `trimray export` describes; its knots must be the ones made here."""
        points = np.array(data["control_points"]).reshape(*data["points"], 4)
        made = cls(data["degree"], np.array(data["bounds"]), points)
        for mine, theirs in zip(made.knots, data["knots"], strict=True):
            span = mine[-1] - mine[0]
            fail_unless(np.abs(mine - theirs).max() <= 1e-15 * max(span, np.abs(mine).max()), "knots differ")
        return made

    def __call__(self, points):
        """Deforms points (N, 3); those outside the box stay as they are.

        Points that a rounding has put out of a face of the box belong to the box.
        """
        out = np.array(points, float)
        nearest = np.clip(out, *self.bounds)
        inside = np.abs(out - nearest).max(axis=1) <= ON_BOX * np.linalg.norm(self.bounds[1] - self.bounds[0])
        out[inside] = nearest[inside]
        places = np.flatnonzero(inside)
        for start in range(0, len(places), CHUNK):
            chunk = places[start : start + CHUNK]
            out[chunk] = self._inside(out[chunk])
        return out

    def _inside(self, points):
        basis, index = [], []
        for axis in range(3):
            k = self.degree[axis]
            rows = BSpline.design_matrix(points[:, axis], self.knots[axis], k)
            basis.append(rows.data.reshape(-1, k + 1))
            index.append(rows.indices.reshape(-1, k + 1))
        i, j, k = index
        local = self.homogeneous[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
        local = np.einsum("nijkc,nk->nijc", local, basis[2])
        local = np.einsum("nijc,nj->nic", local, basis[1])
        local = np.einsum("nic,ni->nc", local, basis[0])
        return local[:, :3] / local[:, 3:]


# ------------------------------------------------------------------------------------------------------- the objects


@dataclass
class DeformedObject:
    """One object: the placed, undeformed mesh, and the chain of volumes it goes through."""

    name: str
    positions: np.ndarray
    faces: list
    volumes: list = field(default_factory=list)

    @cached_property
    def fanned(self):
        """Undeformed triangles, and the face of each."""
        return fan(self.positions, self.faces)

    @property
    def triangles(self):
        """Undeformed triangles (T, 3, 3) of a mesh with convex faces."""
        return self.fanned[0]

    @property
    def diagonal(self):
        """Diagonal of the deformed corners' box."""
        corners = self.deform(self.positions)
        return np.linalg.norm(corners.max(0) - corners.min(0))

    def deform(self, points):
        """The exact place of undeformed points (N, 3)."""
        points = np.asarray(points, float)
        for volume in self.volumes:
            points = volume(points)
        return points

    def at(self, triangle, weights):
        """Undeformed points of triangles (N,) at the barycentric weights (N, 3) of their corners."""
        return np.einsum("nij,ni->nj", self.triangles[triangle], weights)


def exported(scene):
    """What `trimray export` writes for a scene."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "exported.json"
        trimray("export", scene, "-o", path)
        return json.loads(path.read_text(encoding="utf-8"))


def load_objects(scene):
    """All objects of a scene, in its order."""
    scene = Path(scene)
    description = tomllib.loads(scene.read_text(encoding="utf-8"))
    objects = []
    for entry, data in zip(description["object"], exported(scene)["objects"], strict=True):
        fail_unless(entry["name"] == data["name"], "objects are exported in the scene's order")
        if "surface" in entry:
            print(f"{scene.name}: {entry['name']} is a surface, which analytic.py checks")
            continue
        if entry.get("method", "exact") != "exact":
            print(f"{scene.name}: {entry['name']} is {entry['method']}, which is not the volume")
            continue
        deforms = entry.get("deform", [])
        fail_unless(all(deform["type"] == "ffd" for deform in deforms), "only FFD is known to this check")
        fail_unless(len(deforms) == len(data["volumes"]), "one volume for each FFD")
        positions, faces = read_obj(scene.parent / entry["mesh"])
        matrix = placement(entry.get("transform", []))
        positions = positions @ matrix[:3, :3].T + matrix[:3, 3]
        volumes = [Volume.exported(volume) for volume in data["volumes"]]
        for deform, volume in zip(deforms, volumes, strict=True):
            fail_unless(deform["degree"] == volume.degree, "degree as in the scene")
        if deforms and "bounds" not in deforms[0]:
            used = positions[np.unique(np.concatenate(faces))]
            box = np.array([used.min(0), used.max(0)])
            off = np.abs(box - volumes[0].bounds).max()
            fail_unless(off <= 1e-14 * np.abs(box).max(), f"default box of the lattice is off by {off:g}")
        objects.append(DeformedObject(entry["name"], positions, faces, volumes))
    return objects


# ------------------------------------------------------------------------------------------------------ tessellation


@dataclass
class Tessellation:
    """An object's triangles, each cut into n², with the vertices on the deformed surface."""

    vertices: np.ndarray
    indices: np.ndarray
    n: int
    # Barycentric weights of a triangle's points, and its small triangles as indices into them.
    corner_weights: np.ndarray
    small: np.ndarray
    deviation: float

    @property
    def triangles_per_triangle(self):
        """Small triangles of each undeformed one, which follow each other."""
        return self.n * self.n


def grid(n):
    """Barycentric weights (M, 3) of the points of a triangle cut into n², and its small triangles (n², 3)."""
    i, j = np.nonzero(np.add.outer(np.arange(n + 1), np.arange(n + 1)) <= n)
    weights = np.stack([n - i - j, i, j], axis=1) / n
    number = np.full((n + 2, n + 2), -1)
    number[i, j] = np.arange(len(i))
    a, b, c, d = number[i, j], number[i + 1, j], number[i, j + 1], number[i + 1, j + 1]
    upper = i + j < n
    lower = i + j < n - 1
    small = np.concatenate([np.stack([a, b, c], 1)[upper], np.stack([b, d, c], 1)[lower]])
    return weights, small


def tessellate(target, n):
    """Tessellates an object and measures how far the flat triangles are from the exact surface.

    The deviation is the greatest distance between a small triangle's middle or edge midpoints and the surface's point at
    the same undeformed place. For a triangle of size h the error is at most h² max|second derivative| / 8 times a factor
    near 1, and largest near these places; half as much again is added for what lies between them.
    """
    if not target.volumes:
        n = 1
    weights, small = grid(n)
    rest = np.einsum("tij,wi->twj", target.triangles, weights)
    vertices = target.deform(rest.reshape(-1, 3)).reshape(rest.shape)
    count = len(weights)
    indices = (small[None] + count * np.arange(len(target.triangles))[:, None, None]).reshape(-1, 3)
    deviation = 0.0
    if target.volumes:
        places = np.array([[1, 1, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]], float)
        places /= places.sum(1, keepdims=True)
        for triangle in range(len(target.triangles)):
            for place in places:
                at = np.einsum("sij,i->sj", rest[triangle][small], place)
                flat = np.einsum("sij,i->sj", vertices[triangle][small], place)
                deviation = max(deviation, np.linalg.norm(target.deform(at) - flat, axis=1).max())
    return Tessellation(vertices.reshape(-1, 3), indices, n, weights, small, 1.5 * deviation)


# ------------------------------------------------------------------------------------- patches against the volume


def bernstein(degree, t):
    """Bernstein polynomials (N, degree + 1) at t (N,), by the triangle of convex combinations."""
    values = np.ones((len(t), 1))
    for _ in range(degree):
        left = np.pad(values, ((0, 0), (0, 1))) * (1 - t)[:, None]
        right = np.pad(values, ((0, 0), (1, 0))) * t[:, None]
        values = left + right
    return values


def check_patches(scene, samples=64):
    """Every exported patch against the volume at random points of its trim; returns the greatest deviation / diagonal."""
    random = np.random.default_rng(7)
    worst, patches = 0.0, 0
    by_name = {data["name"]: data for data in exported(scene)["objects"]}
    for target in load_objects(scene):
        data = by_name[target.name]
        if len(target.volumes) > 1:
            # its patches stand for the formula; hits on that are checked by the unit tests and examples/cells.rs
            print(f"{Path(scene).name}: {target.name} goes through {len(target.volumes)} volumes, which this does not check")
            continue
        for patch in data["patches"]:
            m, n = patch["degree"]
            net = np.array(patch["control_points"]).reshape(m + 1, n + 1, 4)
            net[..., :3] *= net[..., 3:]
            places = []
            for trim in patch["trim"]:
                mix = random.dirichlet(np.ones(len(trim["loop"])), samples // len(patch["trim"]) + 1)
                places.append(mix @ np.array(trim["loop"]))
            st = np.concatenate(places)
            point = np.einsum("ni,nj,ijc->nc", bernstein(m, st[:, 0]), bernstein(n, st[:, 1]), net)
            frame = {key: np.array(value) for key, value in patch["frame"].items()}
            rest = frame["origin"] + st[:, :1] * frame["s"] + st[:, 1:] * frame["t"]
            off = np.linalg.norm(point[:, :3] / point[:, 3:] - target.deform(rest), axis=1).max()
            worst = max(worst, off / target.diagonal)
            patches += 1
    return patches, worst


def write_random_scene(folder, degree, rational, random):
    """A tilted cube in a random lattice, with parts outside of it; returns the scene's path."""
    points = [k + 2 for k in degree]
    lattice = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in points), indexing="ij"), axis=-1)
    lattice = lattice + random.uniform(-0.15, 0.15, lattice.shape)
    if rational:
        lattice = np.concatenate([lattice, np.exp(random.uniform(-1, 1, (*points, 1)))], axis=-1)
    np.save(folder / "lattice.npy", lattice)
    (folder / "scene.toml").write_text(
        f"""
[[object]]
name = "cube"
mesh = "{ROOT / "scenes" / "meshes" / "feng_fig07_cube.obj"}"
transform = [ {{ scale = 0.8 }}, {{ rotate = {{ axis = [1, 2, 3], angle = 40 }} }}, {{ translate = [0.1, 0.2, 0.1] }} ]
[[object.deform]]
type = "ffd"
degree = {degree}
points = {points}
bounds = [[0, 0, 0], [1, 1, 1]]
[[object.deform.edit]]
control_points = "lattice.npy"
""",
        encoding="utf-8",
    )
    return folder / "scene.toml"


def main():
    """Checks the scenes named on the command line, and random lattices of all degrees."""
    fail_unless(len(sys.argv) > 1, "name the scenes to check")
    for scene in sys.argv[1:]:
        patches, worst = check_patches(scene)
        print(f"{Path(scene).name}: {patches} patches, deviation from SciPy's volume {worst:.1e} of the diagonal")
        fail_unless(worst <= 1e-12, f"{scene}: a patch is not the volume")
    random = np.random.default_rng(11)
    with tempfile.TemporaryDirectory() as folder:
        for rational, bound in [(False, 1e-12), (True, 1e-11)]:
            patches, worst = 0, 0.0
            for degree in product(range(1, 5), repeat=3):
                scene = write_random_scene(Path(folder), list(degree), rational, random)
                count, deviation = check_patches(scene)
                fail_unless(deviation <= bound, f"degree {degree}, rational {rational}: {deviation:g}")
                patches, worst = patches + count, max(worst, deviation)
            kind = "rational" if rational else "polynomial"
            print(f"64 random {kind} lattices, degrees 1 to 4: {patches} patches, deviation {worst:.1e}")


if __name__ == "__main__":
    main()
