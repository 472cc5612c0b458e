"""Lattices of other programs' files against those programs' own formulas, written in NumPy.

A turned cube is deformed by a file of each format with random control points; places where rays hit it are compared with
the formula of the program that the file is of, at the hits' places on the undeformed cube.

    python lattices.py
"""

import json
import tempfile
from math import comb
from pathlib import Path

import numpy as np

from deformed import fail_unless, trimray

# Of a box of size 1: what exact surfaces promise.
TOLERANCE = 1e-11

RAYS = 20_000

CUBE = """\
v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1
f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6
"""

ORIGIN = np.array([-0.75, -0.5, -0.625])
LENGTH = np.array([1.5, 1.25, 1.5])


def bernstein(n, x):
    """Bernstein polynomials of degree n at x, the last index their number: as in PyGeM's and SU2's sums."""
    return np.stack([comb(n, i) * (1 - x) ** (n - i) * x**i for i in range(n + 1)], axis=-1)


def cox_de_boor(knots, degree, x):
    """B-splines by their recursion, over the whole knot vector, the last index their number."""
    knots = np.asarray(knots, float)
    low, high = knots[degree], knots[-degree - 1]
    spans = len(knots) - 1
    # the last interval of the domain is closed
    last = max(i for i in range(spans) if knots[i] < knots[i + 1] <= high)
    inside = [(knots[i] <= x) & ((x < knots[i + 1]) | ((i == last) & (x == high))) for i in range(spans)]
    basis = np.stack(inside, axis=-1).astype(float)
    assert ((x >= low) & (x <= high)).all()
    for level in range(1, degree + 1):
        raised = np.zeros(x.shape + (spans - level,))
        for i in range(spans - level):
            for j, start, end in ((i, knots[i], knots[i + level]), (i + 1, knots[i + level + 1], knots[i + 1])):
                if start != end:
                    raised[..., i] += (x - start) / (end - start) * basis[..., j]
        basis = raised
    return basis


def clamped(points, degree):
    inner = np.arange(1, points - degree) / (points - degree)
    return np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])


def tensor(bases, points):
    return np.einsum("ni,nj,nk,ijkc->nc", *bases, points)


def greville(knots, degree):
    return np.array([np.mean(knots[i + 1 : i + degree + 1]) for i in range(len(knots) - degree - 1)])


def grid(parts):
    return ORIGIN + LENGTH * np.stack(np.meshgrid(*parts, indexing="ij"), axis=-1)


def box_keys():
    return f"bounds = [{ORIGIN.tolist()}, {(ORIGIN + LENGTH).tolist()}]"


class PyGeM:
    """psi^-1(psi(X) + sum b mu), of `pygem/ffd.py`."""

    name = "pygem.prm"
    counts = [4, 3, 5]
    keys = f'basis = "bezier"\npoints = {counts}\n{box_keys()}'

    def __init__(self, rng):
        self.mu = 0.1 * rng.uniform(-1, 1, self.counts + [3])

    def write(self, folder):
        lines = ["[Box info]"]
        for name, values in (
            ("n control points", self.counts),
            ("box length", LENGTH),
            ("box origin", ORIGIN),
            ("rotation angle", [0, 0, 0]),
        ):
            lines += [f"{name} {axis}: {value}" for axis, value in zip("xyz", values)]
        lines.append("[Parameters weights]")
        for c, axis in enumerate("xyz"):
            entries = [f"{i} {j} {k} {float(self.mu[i, j, k, c])!r}" for i, j, k in np.ndindex(*self.counts)]
            lines.append(f"parameter {axis}: " + "\n    ".join(entries))
        (folder / self.name).write_text("\n".join(lines) + "\n")

    def evaluate(self, places):
        u = (places - ORIGIN) / LENGTH
        bases = [bernstein(n - 1, u[:, axis]) for axis, n in enumerate(self.counts)]
        return ORIGIN + LENGTH * (u + tensor(bases, self.mu))


class Su2:
    """Sums over the control points of a box, of `CFreeFormDefBox.cpp`."""

    def __init__(self, rng, counts, orders):
        self.counts, self.orders = counts, orders
        self.name = "bezier.su2" if orders is None else "spline.su2"
        degree = [n - 1 for n in counts] if orders is None else [order - 1 for order in orders]
        self.keys = f"degree = {degree}\npoints = {counts}\n{box_keys()}"
        # SU2 has them evenly before they move
        even = grid([np.arange(n) / (n - 1) for n in counts])
        self.points = even + 0.1 * rng.uniform(-1, 1, even.shape)

    def write(self, folder):
        low, high = ORIGIN, ORIGIN + LENGTH
        corners = [[low, high][c] for c in (0, 1)]
        order = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        lines = ["NDIME= 3", "FFD_NBOX= 1", "FFD_NLEVEL= 1", "FFD_TAG= BOX", "FFD_LEVEL= 0"]
        lines += [f"FFD_DEGREE_{name}= {n - 1}" for name, n in zip("IJK", self.counts)]
        lines.append("FFD_BLENDING= " + ("BEZIER" if self.orders is None else "BSPLINE_UNIFORM"))
        lines += [f"BSPLINE_ORDER_{name}= {n}" for name, n in zip("IJK", self.orders or [])]
        lines += ["FFD_PARENTS= 0", "FFD_CHILDREN= 0", "FFD_CORNER_POINTS= 8"]
        lines += [" ".join(repr(float(corners[end][axis])) for axis, end in enumerate(ends)) for ends in order]
        lines.append(f"FFD_CONTROL_POINTS= {self.points[..., 0].size}")
        for i, j, k in np.ndindex(*self.counts):
            lines.append("\t".join(map(str, [i, j, k, *(repr(float(x)) for x in self.points[i, j, k])])))
        (folder / self.name).write_text("\n".join(lines) + "\nFFD_SURFACE_POINTS= 0\n")

    def evaluate(self, places):
        u = (places - ORIGIN) / LENGTH
        if self.orders is None:
            bases = [bernstein(n - 1, u[:, axis]) for axis, n in enumerate(self.counts)]
        else:
            knots = [clamped(n, order - 1) for n, order in zip(self.counts, self.orders)]
            bases = [cox_de_boor(t, order - 1, u[:, axis]) for axis, (t, order) in enumerate(zip(knots, self.orders))]
        return tensor(bases, self.points)


class PyGeo:
    """A box of pyGeo whose control points were the Greville abscissae, of `pyBlock.py`: degree 3, or less of fewer points."""

    name = "pygeo.xyz"
    counts = [6, 3, 4]
    degree = [min(3, n - 1) for n in counts]
    keys = f"degree = {degree}\npoints = {counts}\n{box_keys()}"
    block = "block = 2"

    def __init__(self, rng):
        self.knots = [clamped(n, k) for n, k in zip(self.counts, self.degree)]
        points = grid([greville(t, k) for t, k in zip(self.knots, self.degree)])
        self.points = points + 0.1 * rng.uniform(-1, 1, points.shape)

    def write(self, folder):
        other = np.zeros((2, 2, 2, 3))
        text = f"2\n2 2 2\n{' '.join(map(str, self.counts))}\n"
        for points in (other, self.points):
            for c in range(3):
                text += " ".join(repr(float(x)) for x in points[..., c].flatten(order="F")) + "\n"
        (folder / self.name).write_text(text)

    def evaluate(self, places):
        u = (places - ORIGIN) / LENGTH
        bases = [cox_de_boor(t, k, u[:, axis]) for axis, (t, k) in enumerate(zip(self.knots, self.degree))]
        return tensor(bases, self.points)


class Archive:
    """A rational volume of any knots, as splinepy evaluates it, the domain of its knots taken to the box."""

    name = "any.npz"
    degree = [2, 3, 2]
    knots = [
        [0, 0, 0, 1, 1, 2, 3, 3, 3],
        [-2, -1, -1, 0, 0.5, 2, 2, 3, 4],
        [10, 10, 10, 11, 14, 14, 14],
    ]
    counts = [len(t) - k - 1 for t, k in zip(knots, degree)]
    keys = f"degree = {degree}\npoints = {counts}\nknots = {knots}\n{box_keys()}"

    def __init__(self, rng):
        domains = [(t[k], t[-k - 1]) for t, k in zip(self.knots, self.degree)]
        self.unit = [(np.array(t) - low) / (high - low) for t, (low, high) in zip(self.knots, domains)]
        points = grid([greville(t, k) for t, k in zip(self.unit, self.degree)])
        self.points = points + 0.05 * rng.uniform(-1, 1, points.shape)
        self.weights = rng.uniform(0.5, 2, self.counts)

    def write(self, folder):
        knots = {f"knots_{name}": np.array(t, float) for name, t in zip("xyz", self.knots)}
        arrays = {"control_points": self.points, "weights": self.weights, "degrees": np.array(self.degree)}
        np.savez(folder / self.name, **arrays, **knots)

    def evaluate(self, places):
        # rounding of a place on the box's border
        u = np.clip((places - ORIGIN) / LENGTH, 0, 1)
        bases = [cox_de_boor(t, k, u[:, axis]) for axis, (t, k) in enumerate(zip(self.unit, self.degree))]
        homogeneous = np.concatenate([self.points * self.weights[..., None], self.weights[..., None]], axis=-1)
        values = tensor(bases, homogeneous)
        return values[:, :3] / values[:, 3:]


def check(lattice, rng):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "cube.obj").write_text(CUBE)
        lattice.write(folder)
        scene = folder / "scene.toml"
        scene.write_text(
            '[[object]]\nname = "cube"\nmesh = "cube.obj"\n'
            "transform = [{ translate = [-0.5, -0.5, -0.5] }, { scale = 0.7 }, { rotate = { axis = [1, 2, 3], angle = 25 } }]\n"
            f'[[object.deform]]\ntype = "ffd"\noutside = "error"\n{lattice.keys}\n'
            f'[[object.deform.edit]]\ncontrol_points = "{lattice.name}"\n{getattr(lattice, "block", "")}\n'
        )
        origins = rng.normal(size=(RAYS, 3))
        origins *= 4 / np.linalg.norm(origins, axis=1, keepdims=True)
        targets = 0.4 * rng.uniform(-1, 1, (RAYS, 3))
        np.save(folder / "rays.npy", np.concatenate([origins, targets - origins], axis=1))
        trimray("trace", scene, "--rays", folder / "rays.npy", "-o", folder / "hits.npz")
        info = json.loads(trimray("info", scene, "--json"))["objects"][0]
        with np.load(folder / "hits.npz") as hits:
            hit = hits["object"] >= 0
            error = np.abs(lattice.evaluate(hits["rest"][hit]) - hits["position"][hit]).max()
        print(f"{lattice.name}: {hit.sum()} hits, {info['patches']} patches, greatest error {error:.1e}")
        fail_unless(hit.sum() > RAYS // 2, f"{lattice.name}: only {hit.sum()} of {RAYS} rays hit")
        fail_unless(error < TOLERANCE, f"{lattice.name}: hits are {error} from the formula")


def main():
    rng = np.random.default_rng(19)
    lattices = [PyGeM(rng), Su2(rng, [4, 3, 3], None), Su2(rng, [6, 4, 3], [4, 3, 2]), PyGeo(rng), Archive(rng)]
    for lattice in lattices:
        check(lattice, rng)


if __name__ == "__main__":
    main()
