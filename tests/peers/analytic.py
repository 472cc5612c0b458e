"""Hits of deformed surfaces against their formulas, evaluated without trimray's code: NumPy, over complex numbers.

    python analytic.py SCENE...

Random rays are traced by `trimray trace`. Each hit's place and normal are compared with the scene file's formula at the
hit's (u, v): Bernstein and B-spline polynomials, extension functions and lattices written down once more. Partial derivatives
are imaginary parts of values a tiny imaginary step away, so they have no truncation error.
"""

import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

from deformed import binary, exported, fail_unless, placement

RAYS = 40_000

# In parts of the diagonal, and for unit vectors.
POSITION = 1e-12
NORMAL = 1e-10

NAMES = {name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "sqrt")}
NAMES |= {"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "ln": np.log, "pi": np.pi, "e": np.e}
# the absolute value, analytic on either side
NAMES["abs"] = lambda x: np.where(np.real(x) >= 0, x, -x)


def expression(text, u, v):
    """The value of an expression; Python's precedences are those of scene files."""
    return eval(text.replace("^", "**"), {"__builtins__": {}}, NAMES | {"u": u, "v": v})  # noqa: S307


def basis(knots, degree, x):
    """B-spline basis functions (N, n) by the recursion of Cox and de Boor, with the interval of the real part."""
    knots = np.asarray(knots, float)
    last = np.flatnonzero(knots[:-1] < knots[1:])[-1]
    interval = np.minimum(np.searchsorted(knots, x.real, side="right") - 1, last)
    values = (np.arange(len(knots) - 1)[None, :] == interval[:, None]).astype(complex)
    for k in range(1, degree + 1):
        lower = values
        values = np.zeros((len(x), len(knots) - 1 - k), complex)
        for i in range(values.shape[1]):
            if knots[i + k] > knots[i]:
                values[:, i] += (x - knots[i]) / (knots[i + k] - knots[i]) * lower[:, i]
            if knots[i + k + 1] > knots[i + 1]:
                values[:, i] += (knots[i + k + 1] - x) / (knots[i + k + 1] - knots[i + 1]) * lower[:, i + 1]
    return values


def surface(entry, u, v):
    """Points (N, 3) of a surface."""
    kind = entry["type"]
    if kind == "plane":
        origin, along_u, along_v = (np.array(entry.get(key, [0, 0, 0]), float) for key in ("origin", "u", "v"))
        return origin + u[:, None] * along_u + v[:, None] * along_v
    fail_unless(kind in ("bezier", "bspline", "nurbs"), f"surface {kind} is not known to this check")
    degree = entry["degree"]
    size = [k + 1 for k in degree] if kind == "bezier" else entry["size"]
    knots = [entry.get(f"knots_{axis}") for axis in "uv"]
    for axis in range(2):
        if knots[axis] is None:
            k, inner = degree[axis], size[axis] - degree[axis]
            knots[axis] = [0] * (k + 1) + [i / inner for i in range(1, inner)] + [1] * (k + 1)
    points = np.array(entry["points"], float).reshape(*size, 3)
    weights = np.array(entry.get("weights", np.ones(size)), float).reshape(*size)
    homogeneous = np.concatenate([points * weights[..., None], weights[..., None]], -1)
    sums = np.einsum("ni,nj,ijc->nc", basis(knots[0], degree[0], u), basis(knots[1], degree[1], v), homogeneous)
    return sums[:, :3] / sums[:, 3:]


def lattice(volume, points):
    """Points through an exported volume; those outside stay."""
    shape = volume["points"]
    control = np.array(volume["control_points"]).reshape(*shape, 4)
    homogeneous = np.concatenate([control[..., :3] * control[..., 3:], control[..., 3:]], -1)
    low, high = np.array(volume["bounds"])
    slack = 1e-12 * np.abs(np.array([low, high])).max()
    inside = ((points.real >= low - slack) & (points.real <= high + slack)).all(1)
    out = points.copy()
    parts = points[inside]
    clipped = np.clip(parts.real, low, high) + 1j * parts.imag
    x, y, z = (basis(volume["knots"][a], volume["degree"][a], clipped[:, a]) for a in range(3))
    sums = np.einsum("ni,nj,nk,ijkc->nc", x, y, z, homogeneous, optimize=True)
    out[inside] = sums[:, :3] / sums[:, 3:]
    return out


def regions(deform, u, v):
    """For each region its entry, where it is inside, and factor · phi^n."""
    for entry in deform["region"]:
        phi = expression(entry["bound"], u, v) * np.ones_like(u)
        factor = expression(entry["factor"], u, v) if "factor" in entry else 1.0
        inside = phi.real <= 0
        yield entry, inside, np.where(inside, factor * np.where(inside, phi, 0) ** entry["index"], 0)


def matrix(h):
    """The 3x3 matrix of h."""
    h = np.array(h, float)
    return np.eye(3) * h if h.ndim < 2 else h


def extension(deform, points, u, v):
    """Points through extension functions."""
    mode, center = deform["mode"], np.array(deform.get("center", [0, 0, 0]), float)
    if mode == "operator":
        axes = np.array(deform.get("axes", np.eye(3)), float).T
        axes /= np.linalg.norm(axes, axis=0)
        local = (points - center) @ np.linalg.inv(axes).T
        for entry, _, exponent in reversed(list(regions(deform, u, v))):
            grown = np.expm1(exponent[:, None, None] * matrix(entry["h"]))
            signs = np.array(entry.get("epsilon", np.ones((3, 3))), float)
            local = local + np.einsum("nij,nj->ni", grown * signs, local)
        return local @ axes.T + center
    if mode == "radial":
        moved = points
        for entry, _, exponent in regions(deform, u, v):
            own = np.array(entry.get("center", center), float)
            moved = moved + np.expm1(exponent * matrix(entry["h"])[0, 0])[:, None] * (points - own)
        return moved
    raise SystemExit("mode field is not known to this check")


def formula(entry, volumes, u, v):
    """Points of an object at its parameters."""
    placed = placement(entry.get("transform", []))
    points = surface(entry["surface"], u, v) @ placed[:3, :3].T + placed[:3, 3]
    volumes = iter(volumes)
    for deform in entry.get("deform", []):
        ffd = deform["type"] == "ffd"
        points = lattice(next(volumes), points) if ffd else extension(deform, points, u, v)
    return points


def trace(scene, rays):
    """The arrays of `trimray trace`."""
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder) / "rays.npy", Path(folder) / "hits.npz"
        np.save(source, rays)
        command = [str(binary()), "trace", str(scene), "--rays", str(source), "-o", str(made), "--quiet"]
        subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
        return dict(np.load(made))


def check(scene):
    """Compares all hits of random rays with the formulas."""
    scene = Path(scene)
    entries = tomllib.loads(scene.read_text(encoding="utf-8"))["object"]
    data = exported(scene)["objects"]
    random = np.random.default_rng(11)
    points = [np.array(patch["control_points"])[:, :3] for item in data for patch in item["patches"]]
    low, high = np.concatenate(points).min(0), np.concatenate(points).max(0)
    diagonal = np.linalg.norm(high - low)
    target = low + random.random((RAYS, 3)) * (high - low)
    way = random.normal(size=(RAYS, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    hits = trace(scene, np.hstack([target - 2 * diagonal * way, way]))
    worst, count = [0.0, 0.0], 0
    for index, (entry, item) in enumerate(zip(entries, data, strict=True)):
        if "surface" not in entry:
            continue
        chosen = hits["object"] == index
        u, v = hits["uv"][chosen].T.astype(complex)
        count += len(u)
        off = np.linalg.norm(formula(entry, item["volumes"], u, v).real - hits["position"][chosen], axis=1) / diagonal
        step = 1e-30j
        by_u = formula(entry, item["volumes"], u + step, v).imag
        by_v = formula(entry, item["volumes"], u, v + step).imag
        by_u /= np.linalg.norm(by_u, axis=1)[:, None]
        by_v /= np.linalg.norm(by_v, axis=1)[:, None]
        normal = np.cross(by_u, by_v)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        turned = np.linalg.norm(normal - hits["normal"][chosen], axis=1)
        worst = [max(worst[0], off.max(initial=0)), max(worst[1], turned.max(initial=0))]
    fail_unless(count > RAYS // 20, f"{scene.name}: only {count} hits")
    fail_unless(worst[0] <= POSITION, f"{scene.name}: a hit is {worst[0]:.1e} from its formula")
    fail_unless(worst[1] <= NORMAL, f"{scene.name}: a normal is {worst[1]:.1e} off")
    print(f"{scene.name}: {count} hits, positions within {worst[0]:.1e}, normals within {worst[1]:.1e}")


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        check(argument)
