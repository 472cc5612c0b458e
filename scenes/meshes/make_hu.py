#!/usr/bin/env python3
"""Models and scenes after the figures of Hu, Zhang, Tai, Sun: Direct manipulation of FFD (The Visual Computer, 2001).

    python3 scenes/meshes/make_hu.py             writes scenes/meshes/hu_*.obj and scenes/hu_*.toml, and checks them
    python3 scenes/meshes/make_hu.py --preview D also writes them to folder D with solved lattices (.npy)

The models are our own. Every drag is solved here too: for the single moves of figure 7, and so that each scene is known
to reach its targets and not to fold before it ships.
"""

import math
import os
import struct
import sys

MESHES = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.dirname(MESHES)


# ---------------------------------------------------------------- vectors and linear systems


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def moved(points, moves):
    """Targets, without the last digits of the sums."""
    return [tuple(round(x, 12) for x in add(p, m)) for p, m in zip(points, moves)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def mix(a, b, t):
    return a + (b - a) * t


def smooth(a, b, x):
    """0 up to `a`, 1 from `b` on, smooth between."""
    t = min(1.0, max(0.0, (x - a) / (b - a)))
    return t * t * (3.0 - 2.0 * t)


def through(knots, x):
    """Monotone cubic (Fritsch, Carlson 1980) through the pairs `knots`."""
    xs, ys = zip(*knots)
    slopes = [(ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i]) for i in range(len(xs) - 1)]
    tangents = (
        [slopes[0]]
        + [0.0 if a * b <= 0.0 else 2.0 * a * b / (a + b) for a, b in zip(slopes, slopes[1:])]
        + [slopes[-1]]
    )
    i = max(k for k in range(len(slopes)) if k == 0 or xs[k] <= x)
    width = xs[i + 1] - xs[i]
    t = (x - xs[i]) / width
    return (
        ys[i] * (1 + 2 * t) * (1 - t) ** 2
        + ys[i + 1] * t * t * (3 - 2 * t)
        + width * t * (1 - t) * (tangents[i] * (1 - t) - tangents[i + 1] * t)
    )


def solve(matrix, right):
    """Gaussian elimination with partial pivoting; `right` has a tuple in each row."""
    n = len(matrix)
    rows = [list(matrix[i]) + list(right[i]) for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            if factor != 0.0:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    for k in reversed(range(n)):
        for i in range(k + 1, n):
            rows[k][n:] = [a - rows[k][i] * b for a, b in zip(rows[k][n:], rows[i][n:])]
        rows[k][n:] = [a / rows[k][k] for a in rows[k][n:]]
    return [tuple(row[n:]) for row in rows]


# ---------------------------------------------------------------- lattices and drags


def knots_of(points, degree, low, high):
    cells = points - degree
    inner = [low + (high - low) * i / cells for i in range(cells + 1)]
    return [low] * degree + inner + [high] * degree


def basis(knots, degree, x, order=None):
    """The B-spline basis functions of `degree` at `x`, as {index: value}; those of a lower `order` in the same span."""
    span = degree
    while span < len(knots) - degree - 2 and knots[span + 1] <= x:
        span += 1
    values = {span: 1.0}
    for d in range(1, (degree if order is None else order) + 1):
        higher = {}
        for i in range(span - d, span + 1):
            value = 0.0
            if i in values:
                value += (x - knots[i]) / (knots[i + d] - knots[i]) * values[i]
            if i + 1 in values:
                value += (knots[i + d + 1] - x) / (knots[i + d + 1] - knots[i + 1]) * values[i + 1]
            higher[i] = value
        values = higher
    return values


def slopes(knots, degree, x):
    """The first derivatives of the basis functions of `degree` at `x`, as {index: value}."""
    lower = basis(knots, degree, x, degree - 1)
    out = {}
    for i in range(min(lower) - 1, max(lower) + 1):
        value = 0.0
        if i in lower:
            value += degree / (knots[i + degree] - knots[i]) * lower[i]
        if i + 1 in lower:
            value -= degree / (knots[i + degree + 1] - knots[i + 1]) * lower[i + 1]
        out[i] = value
    return out


class Lattice:
    """A cubic lattice over a box. Control points start at the Greville abscissae: the identity."""

    degree = 3

    def __init__(self, points, bounds, hold=0):
        self.points, self.bounds, self.hold = tuple(points), bounds, hold
        self.knots = [knots_of(n, self.degree, lo, hi) for n, lo, hi in zip(points, *bounds)]
        greville = [
            [sum(k[i + 1 : i + 1 + self.degree]) / self.degree for i in range(n)] for k, n in zip(self.knots, points)
        ]
        self.control = {
            (i, j, k): (x, y, z)
            for i, x in enumerate(greville[0])
            for j, y in enumerate(greville[1])
            for k, z in enumerate(greville[2])
        }

    def contains(self, p):
        return all(lo <= x <= hi for x, lo, hi in zip(p, *self.bounds))

    def weights(self, p):
        """The basis functions of the control points at `p`, as {(i, j, k): value}."""
        u, v, w = (basis(k, self.degree, x) for k, x in zip(self.knots, p))
        return {(i, j, k): a * b * c for i, a in u.items() for j, b in v.items() for k, c in w.items()}

    def free(self, weights):
        """`weights` without those of the held layers."""
        inside = lambda a: all(self.hold <= i < n - self.hold for i, n in zip(a, self.points))
        return {a: b for a, b in weights.items() if inside(a)}

    def position(self, p):
        return self.sum(self.weights(p)) if self.contains(p) else p

    def sum(self, weights):
        return tuple(sum(b * self.control[a][axis] for a, b in weights.items()) for axis in range(3))

    def volume_ratio(self, p):
        """The determinant of the deformation's Jacobian at `p`: not positive where space folds over."""
        if not self.contains(p):
            return 1.0
        u, v, w = (basis(k, self.degree, x) for k, x in zip(self.knots, p))
        du, dv, dw = (slopes(k, self.degree, x) for k, x in zip(self.knots, p))
        columns = []
        for a, b, c in ((du, v, w), (u, dv, w), (u, v, dw)):
            columns.append(
                self.sum({(i, j, k): x * y * z for i, x in a.items() for j, y in b.items() for k, z in c.items()})
            )
        return dot(cross(columns[0], columns[1]), columns[2])

    def drag(self, sources, targets):
        """Moves `sources` (of the undeformed box) to `targets` with the least change of the control points.

        Returns M = G^-1 D and the diagonal of G; source q alone moves by G_qq M_q in the decomposition."""
        rows = [self.free(self.weights(s)) for s in sources]
        gram = [[sum(b * other.get(a, 0.0) for a, b in row.items()) for other in rows] for row in rows]
        moves = [sub(t, self.position(s)) for s, t in zip(sources, targets)]
        multipliers = solve(gram, moves)
        for row, m in zip(rows, multipliers):
            for a, b in row.items():
                self.control[a] = add(self.control[a], tuple(b * x for x in m))
        return multipliers, [gram[q][q] for q in range(len(sources))]


# ---------------------------------------------------------------- models


class Model:
    """A closed polygon mesh; corners are (vertex, texture coordinate) indices."""

    def __init__(self, name, crease):
        self.name, self.crease = name, math.cos(math.radians(crease))
        self.vertices, self.uvs, self.faces = [], [], []
        self.tips = []  # vertices to drag

    def vertex(self, p):
        self.vertices.append(tuple(round(x, 12) + 0.0 for x in p))
        return len(self.vertices) - 1

    def uv(self, u, v):
        self.uvs.append((u, v))
        return len(self.uvs) - 1

    def grid(self, rings, vs, triangles, closed=False):
        """Rings of vertex indices; each runs counter-clockwise about the way from ring to ring, so that outside is out."""
        count = len(rings[0])
        uv = [[self.uv(s / count, v) for s in range(count + 1)] for v in vs]
        for r in range(len(rings) - (not closed)):
            q = (r + 1) % len(rings)
            for s in range(count):
                e = (s + 1) % count
                corners = [
                    (rings[r][s], uv[r][s]),
                    (rings[r][e], uv[r][s + 1]),
                    (rings[q][e], uv[r + 1][s + 1]),
                    (rings[q][s], uv[r + 1][s]),
                ]
                if not triangles:
                    self.faces.append(corners)
                    continue
                # Along the shorter diagonal.
                p = [self.vertices[c[0]] for c in corners]
                a, b = sub(p[0], p[2]), sub(p[1], p[3])
                turn = 0 if dot(a, a) <= dot(b, b) else 1
                c = corners[turn:] + corners[:turn]
                self.faces += [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]

    def cap(self, ring, v, apex=None):
        """Closes `ring` (counter-clockwise seen from outside) by one polygon, or by triangles to the vertex `apex`."""
        count = len(ring)
        if apex is None:
            self.faces.append(
                [
                    (
                        i,
                        self.uv(
                            0.5 + 0.5 * math.cos(2 * math.pi * s / count), 0.5 + 0.5 * math.sin(2 * math.pi * s / count)
                        ),
                    )
                    for s, i in enumerate(ring)
                ]
            )
            return
        for s in range(count):
            self.faces.append(
                [
                    (ring[s], self.uv(s / count, v[0])),
                    (ring[(s + 1) % count], self.uv((s + 1) / count, v[0])),
                    (apex, self.uv((s + 0.5) / count, v[1])),
                ]
            )

    def normal(self, face):
        p = [self.vertices[c[0]] for c in face]
        sum_ = (0.0, 0.0, 0.0)
        for a, b in zip(p[1:], p[2:]):
            sum_ = add(sum_, cross(sub(a, p[0]), sub(b, p[0])))
        return sum_

    def check(self):
        """Every edge has two faces, which run along it in opposite directions; faces are planar and convex; outside is out."""
        edges = {}
        for face in self.faces:
            p = [self.vertices[c[0]] for c in face]
            n = unit(self.normal(face))
            for i, (a, _) in enumerate(face):
                b = face[(i + 1) % len(face)][0]
                assert (a, b) not in edges, (self.name, a, b)
                edges[a, b] = face
                assert abs(dot(sub(p[i], p[0]), n)) < 1e-10, self.name
                turn = cross(sub(p[i], p[i - 1]), sub(p[(i + 1) % len(p)], p[i]))
                assert dot(turn, n) > 0.0, (self.name, face)
        assert all((b, a) in edges for a, b in edges), self.name
        # Each part of the model has its outside out.
        part = list(range(len(self.vertices)))

        def root(v):
            while part[v] != v:
                v = part[v]
            return v

        for a, b in edges:
            part[root(a)] = root(b)
        volumes = {}
        for face in self.faces:
            p = [self.vertices[c[0]] for c in face]
            for a, b in zip(p[1:], p[2:]):
                r = root(face[0][0])
                volumes[r] = volumes.get(r, 0.0) + dot(p[0], cross(a, b)) / 6.0
        assert all(v > 0.0 for v in volumes.values()), (self.name, volumes)

    def box(self):
        return tuple(tuple(f(p[i] for p in self.vertices) for i in range(3)) for f in (min, max))

    def write(self):
        self.check()
        normals = [unit(self.normal(face)) for face in self.faces]
        around = {}
        for f, face in enumerate(self.faces):
            for i, (v, _) in enumerate(face):
                p = [self.vertices[face[j % len(face)][0]] for j in (i - 1, i, i + 1)]
                angle = math.acos(max(-1.0, min(1.0, dot(unit(sub(p[0], p[1])), unit(sub(p[2], p[1]))))))
                around.setdefault(v, []).append((f, angle))
        out = ["# trimray: %s, written by make_hu.py" % self.name, "o %s" % self.name]
        out += ["v %r %r %r" % p for p in self.vertices]
        out += ["vt %.6g %.6g" % p for p in self.uvs]
        lines, known = [], {}
        for f, face in enumerate(self.faces):
            corners = []
            for v, t in face:
                n = (0.0, 0.0, 0.0)
                for g, angle in around[v]:
                    if g == f or dot(normals[f], normals[g]) >= self.crease:
                        n = add(n, tuple(angle * x for x in normals[g]))
                n = "vn %.6f %.6f %.6f" % tuple(round(x, 6) + 0.0 for x in unit(n))
                corners.append("%d/%d/%d" % (v + 1, t + 1, known.setdefault(n, len(known)) + 1))
            lines.append("f " + " ".join(corners))
        out += list(known) + lines
        with open(os.path.join(MESHES, self.name + ".obj"), "w") as file:
            file.write("\n".join(out) + "\n")
        print("%-16s %5d faces, box %s" % (self.name, len(self.faces), self.box()))


def circle(radius, z, count):
    return [
        (radius * math.cos(2 * math.pi * s / count), radius * math.sin(2 * math.pi * s / count), z)
        for s in range(count)
    ]


def revolved(model, profile, count):
    """Rings of vertices of the (radius, z) pairs of `profile`."""
    return [[model.vertex(p) for p in circle(r, z, count)] for r, z in profile]


def lengths(profile):
    """How far along `profile` its points lie, from 0 to 1."""
    sums = [0.0]
    for a, b in zip(profile, profile[1:]):
        sums.append(sums[-1] + math.dist(a, b))
    return [s / sums[-1] for s in sums]


def bottle():
    model = Model("hu_bottle", 40.0)
    outline = [
        (0.3, 0.65),
        (0.6, 0.67),
        (1.0, 0.68),
        (1.7, 0.68),
        (2.1, 0.64),
        (2.5, 0.44),
        (2.8, 0.27),
        (3.1, 0.22),
        (3.45, 0.21),
    ]
    profile = [(0.56, 0.0), (0.60, 0.03), (0.62, 0.1)]
    zs = [0.3, 0.6, 0.9, 1.2, 1.5, 1.75, 1.95, 2.1, 2.25, 2.4, 2.53, 2.65, 2.78, 2.92, 3.08, 3.26, 3.45]
    profile += [(through([(0.1, 0.62)] + outline, z), z) for z in zs]
    profile += [(0.26, 3.47), (0.27, 3.53), (0.26, 3.6), (0.22, 3.62), (0.17, 3.6), (0.15, 3.5), (0.15, 3.1)]
    rings = revolved(model, profile, 36)
    model.grid(rings, lengths(profile), triangles=False)
    model.cap(rings[0][::-1], 0.0)
    model.cap(rings[-1], 1.0)
    return model


def cylinder():
    model = Model("hu_cylinder", 40.0)
    profile = [(1.0, 0.0), (1.0, 2.4), (0.8, 2.4), (0.8, 0.0), (1.0, 0.0)]
    rings = revolved(model, profile[:4], 60)
    model.grid(rings, lengths(profile), triangles=False, closed=True)
    return model


# Half width, upper and lower edge of the fish's body from the lips (y = -2) to the root of the tail.
WIDTH = [
    (-2.0, 0.10),
    (-1.85, 0.16),
    (-1.5, 0.27),
    (-1.0, 0.36),
    (-0.4, 0.37),
    (0.4, 0.26),
    (1.0, 0.12),
    (1.3, 0.07),
    (1.6, 0.04),
    (2.0, 0.015),
]
UPPER = [
    (-2.0, 0.09),
    (-1.85, 0.18),
    (-1.5, 0.36),
    (-1.0, 0.54),
    (-0.4, 0.60),
    (0.4, 0.45),
    (1.0, 0.23),
    (1.25, 0.19),
    (1.5, 0.34),
    (1.75, 0.58),
    (2.0, 0.78),
]
LOWER = [
    (-2.0, -0.08),
    (-1.85, -0.16),
    (-1.5, -0.33),
    (-1.0, -0.49),
    (-0.4, -0.53),
    (0.4, -0.40),
    (1.0, -0.21),
    (1.25, -0.18),
    (1.5, -0.32),
    (1.75, -0.55),
    (2.0, -0.74),
]
# About a ring from the top: dense at the top and the bottom, where the fins stand.
RING = [0.0, 5.0, 16.0, 38.0, 62.0, 88.0, 114.0, 140.0, 164.0, 175.0]


def fish_point(y, degrees, side):
    w, top, bottom = through(WIDTH, y), through(UPPER, y), through(LOWER, y)
    a = math.radians(degrees)
    x, z = w * math.sin(a) * side, mix(bottom, top, 0.5 + 0.5 * math.cos(a))
    dorsal = 0.36 * smooth(-0.95, -0.45, y) * (1.0 - smooth(0.05, 0.85, y))
    anal = 0.24 * smooth(0.25, 0.6, y) * (1.0 - smooth(0.7, 1.1, y))
    if degrees == 0.0:
        z, y = z + dorsal, y + 0.55 * dorsal
    elif degrees == 180.0:
        z, y = z - anal, y + 0.8 * anal
    # The tail is forked.
    reach = abs(z) / 0.78
    y += smooth(1.3, 2.0, y) * (0.38 * reach**2 - 0.28)
    return (x, y, z)


def fish():
    model = Model("hu_fish", 50.0)
    ys = [
        -2.0,
        -1.93,
        -1.82,
        -1.68,
        -1.5,
        -1.3,
        -1.1,
        -0.95,
        -0.82,
        -0.69,
        -0.56,
        -0.42,
        -0.28,
        -0.14,
        0.0,
        0.14,
        0.28,
        0.42,
        0.56,
        0.7,
        0.84,
        0.98,
        1.12,
        1.26,
        1.38,
        1.5,
        1.62,
        1.75,
        1.88,
        2.0,
    ]
    # With y as axis and x to the right, z up, counter-clockwise about +y is from +z over +x.
    around = [(d, 1.0) for d in RING] + [(180.0, 1.0)] + [(d, -1.0) for d in RING[:0:-1]]
    rings = [[fish_point(y, d, side) for d, side in around] for y in ys]
    lip = rings[0]
    mouth = [[(x * f, y, 0.005 + (z - 0.005) * f) for x, _, z in lip] for f, y in ((0.6, -1.75), (0.85, -1.97))]
    rings = [[model.vertex(p) for p in ring] for ring in mouth + rings]
    vs = [0.0, 0.03, 0.05] + [0.05 + 0.95 * (y + 2.0) / 4.0 for y in ys[1:]]
    model.grid(rings, vs, triangles=True)
    model.cap(rings[0][::-1], (0.0, 0.0), model.vertex((0.0, -1.7, 0.005)))
    end = model.vertex((0.0, 1.76, 0.02))
    model.cap(rings[-1], (1.0, 1.0), end)
    # The two pectoral fins: thin leaves that start within the body.
    for side in (1.0, -1.0):
        fin = []
        for t, half, thick in (
            (0.0, 0.07, 0.025),
            (0.3, 0.12, 0.025),
            (0.6, 0.15, 0.02),
            (0.85, 0.13, 0.014),
            (1.0, 0.06, 0.008),
        ):
            centre = (side * (0.28 + 0.24 * t), -0.95 + 0.42 * t, -0.2 - 0.16 * t)
            along, over = (0.0, 0.45, -0.89), (0.87 * side, -0.3, 0.15)
            fin.append(
                [
                    model.vertex(
                        tuple(
                            c + half * math.cos(a) * u + thick * math.sin(a) * o for c, u, o in zip(centre, along, over)
                        )
                    )
                    for a in (side * 2 * math.pi * s / 8 for s in range(8))
                ]
            )
        fin = [ring[::-1] for ring in fin]
        model.grid(fin, [0.0, 0.3, 0.6, 0.85, 1.0], triangles=True)
        for ring, end in ((fin[0][::-1], 0), (fin[-1], 1)):
            centre = tuple(sum(model.vertices[i][axis] for i in ring) / 8 for axis in range(3))
            model.cap(ring, (end, end), model.vertex(centre))
    return model


def ball(model, centre, radii, count, rows, turn=lambda p: p):
    """An ellipsoid of triangles, its poles up and down, turned by `turn` and then moved to `centre`."""
    at = lambda lon, lat: add(
        centre,
        turn(
            (
                radii[0] * math.cos(lat) * math.cos(lon),
                radii[1] * math.cos(lat) * math.sin(lon),
                radii[2] * math.sin(lat),
            )
        ),
    )
    rings = [
        [model.vertex(at(2 * math.pi * s / count, math.pi * (r / rows - 0.5))) for s in range(count)]
        for r in range(1, rows)
    ]
    model.grid(rings, [r / rows for r in range(1, rows)], triangles=True)
    model.cap(rings[0][::-1], (1 / rows, 0.0), model.vertex(at(0.0, -math.pi / 2)))
    model.cap(rings[-1], (1 - 1 / rows, 1.0), model.vertex(at(0.0, math.pi / 2)))


def fish_eyes():
    model = Model("hu_fish_eyes", 60.0)
    for side in (1.0, -1.0):
        ball(model, (side * 0.215, -1.5, 0.12), (0.055, 0.085, 0.085), 14, 8)
    return model


def head_point(lon, lat):
    """An egg with its thin end down: the chin."""
    z = 1.25 * math.sin(lat)
    narrow = 1.0 - 0.36 * (1.0 - smooth(-1.3, 0.5, z))
    return (
        0.95 * math.cos(lat) * math.cos(lon) * narrow,
        0.9 * math.cos(lat) * math.sin(lon) * narrow - 0.1 * (1.0 - smooth(-1.3, 0.2, z)),
        z,
    )


def alien():
    model = Model("hu_alien", 60.0)
    count, rows = 32, 20
    rings = [
        [model.vertex(head_point(2 * math.pi * s / count, math.pi * (r / rows - 0.5))) for s in range(count)]
        for r in range(1, rows)
    ]
    model.grid(rings, [r / rows for r in range(1, rows)], triangles=True)
    model.cap(rings[0][::-1], (1 / rows, 0.0), model.vertex(head_point(0.0, -math.pi / 2)))
    model.cap(rings[-1], (1 - 1 / rows, 1.0), model.vertex(head_point(0.0, math.pi / 2)))
    # The ears: bent leaves that start within the head and end in a round tip.
    for side in (1.0, -1.0):
        ear = []
        stations = [0.0, 0.2, 0.4, 0.55, 0.7, 0.82, 0.91, 0.97]
        for t in stations:
            size = math.sqrt(1.0 - t * t) if t > 0.6 else mix(0.72, 0.8, t / 0.6)
            out, up = 0.7 + 0.9 * t, -0.05 + 0.3 * t + 0.15 * t * t
            tall, deep = 0.3 * size, 0.11 * size
            lean = math.radians(18.0 + 16.0 * t)
            centre = (side * out, 0.04, up)
            across, over = (-side * math.sin(lean), 0.0, math.cos(lean)), (0.0, 1.0, 0.0)
            # Counter-clockwise about the way outwards: (across, over) turned by the side.
            ear.append(
                [
                    model.vertex(
                        tuple(
                            c + tall * math.cos(a) * u + deep * math.sin(a) * o for c, u, o in zip(centre, across, over)
                        )
                    )
                    for a in (-side * 2 * math.pi * s / 14 for s in range(14))
                ]
            )
        model.grid(ear, stations, triangles=True)
        model.cap(ear[0][::-1], (0.0, 0.0), model.vertex((side * 0.7, 0.04, -0.05)))
        tip = model.vertex((side * 1.625, 0.04, 0.412))
        model.cap(ear[-1], (0.97, 1.0), tip)
        model.tips.append(model.vertices[tip])
    return model


def alien_eyes():
    model = Model("hu_alien_eyes", 60.0)
    for side in (1.0, -1.0):
        lean, out = math.radians(28.0 * side), math.radians(25.0 * side)

        def turn(p):
            x, y, z = p
            x, z = x * math.cos(lean) + z * math.sin(lean), z * math.cos(lean) - x * math.sin(lean)
            return (x * math.cos(out) - y * math.sin(out), x * math.sin(out) + y * math.cos(out), z)

        ball(model, (side * 0.36, -0.765, 0.02), (0.17, 0.11, 0.27), 18, 10, turn)
    return model


# ---------------------------------------------------------------- scenes

MATERIALS = {
    "green": ("roughplastic", "diffuse_reflectance = [0.12, 0.4, 0.2]\nalpha = 0.12"),
    "clay": ("diffuse", "reflectance = [0.62, 0.36, 0.22]"),
    "gold": ("roughplastic", "diffuse_reflectance = [0.72, 0.34, 0.08]\nalpha = 0.2"),
    "skin": ("roughplastic", "diffuse_reflectance = [0.3, 0.5, 0.22]\nalpha = 0.25"),
    "black": ("roughplastic", "diffuse_reflectance = [0.015, 0.015, 0.02]\nalpha = 0.08"),
    "board": ("diffuse", "reflectance = [0.5, 0.5, 0.52]"),
}


def vector(p):
    return "[" + ", ".join(repr(0.0 if abs(x) < 1e-15 else x) for x in p) + "]"


def vectors(points, width=120):
    """A TOML list of points, on one line if it fits."""
    line = "[%s]" % ", ".join(vector(p) for p in points)
    return line if len(line) + 7 <= width else "[\n%s]" % "".join("  %s,\n" % vector(p) for p in points)


class Scene:
    def __init__(self, name, comment, camera, light, floor, models, points, bounds, hold=0):
        self.name, self.comment, self.camera, self.light, self.floor = name, comment, camera, light, floor
        self.models = models  # (name, model, material); the lattice is the first one's if there are no bounds
        self.box = bounds or models[0][1].box()
        # Written only where they are needed: for a part of the model, or to deform its eyes alike.
        self.bounds = self.box if bounds or len(models) > 1 else None
        self.lattice = Lattice(points, self.box, hold)
        self.edits = []

    def drag(self, sources, targets):
        assert all(self.lattice.contains(s) for s in sources), self.name
        solved = self.lattice.drag(sources, targets)
        error = max(abs(x) for s, t in zip(sources, targets) for x in sub(self.lattice.position(s), t))
        assert error < 1e-12, (self.name, error)
        self.edits.append((sources, targets))
        return solved

    def worst(self):
        """The least ratio of volumes along the edges and at the faces' middles, and where it is."""
        places = set()
        for _, model, _ in self.models:
            for face in model.faces:
                p = [model.vertices[c[0]] for c in face]
                places.add(tuple(sum(q[axis] for q in p) / len(p) for axis in range(3)))
                for q, r in zip(p, p[1:] + p[:1]):
                    steps = max(1, math.ceil(math.dist(q, r) / 0.15))
                    places |= {tuple(mix(x, y, i / steps) for x, y in zip(q, r)) for i in range(steps)}
        return min((self.lattice.volume_ratio(p), p) for p in places)

    def text(self, meshes="meshes/", solved=None):
        origin, target, fov = self.camera
        out = ["".join("# %s\n" % line for line in self.comment)]
        out.append("[camera]\norigin = %s\ntarget = %s\nfov = %s\n" % (vector(origin), vector(target), fov))
        out.append('[film]\nsize = [480, 360]\nfilter = "gaussian"\n')
        out.append("[render]\nspp = 64\nmax_depth = 6\n")
        for name in sorted({m for _, _, m in self.models} | {"board"}):
            kind, rest = MATERIALS[name]
            out.append('[[material]]\nname = "%s"\ntype = "%s"\n%s\n' % (name, kind, rest))
        out.append('[[light]]\ntype = "constant"\nradiance = [0.34, 0.37, 0.42]\n')
        place, power = self.light
        # The rectangle's normal is +z: turned towards the target.
        way = unit(sub(target, place))
        axis, angle = unit(cross((0.0, 0.0, 1.0), way)), math.degrees(math.acos(way[2]))
        radiance = tuple(round(power * c, 3) for c in (1.0, 0.96, 0.9))
        out.append(
            '[[light]]\ntype = "area"\nshape = "rectangle"\nradiance = %s\nto_world = [\n  { scale = 1.5 },\n'
            "  { rotate = { axis = %s, angle = %.2f } },\n  { translate = %s },\n]\n"
            % (vector(radiance), vector(round(x, 5) for x in axis), angle, vector(place))
        )
        out.append(
            '[[object]]\nname = "board"\nmesh = "%sboard.obj"\nmaterial = "board"\n'
            "transform = [{ scale = 6.0 }, { translate = %s }]\n" % (meshes, vector((0.0, 0.0, self.floor)))
        )
        for name, model, material in self.models:
            out.append(
                '[[object]]\nname = "%s"\nmesh = "%s%s.obj"\nmaterial = "%s"\nnormals = "vertex"\n'
                % (name, meshes, model.name, material)
            )
            deform = '[[object.deform]]\ntype = "ffd"\ndegree = [3, 3, 3]\npoints = %s\n' % list(self.lattice.points)
            if self.bounds:
                deform += "bounds = %s\n" % vectors(self.bounds)
            if self.lattice.hold and not solved:
                deform += "hold = %d\n" % self.lattice.hold
            out.append(deform)
            if solved:
                out.append('[[object.deform.edit]]\ncontrol_points = "%s"\n' % solved)
                continue
            for sources, targets in self.edits:
                out.append("[[object.deform.edit]]\ndrag = %s\nto = %s\n" % (vectors(sources), vectors(targets)))
        return "\n".join(out)

    def write(self, preview):
        with open(os.path.join(SCENES, self.name + ".toml"), "w") as file:
            file.write(self.text())
        ratio, place = self.worst()
        print(
            "%-16s %3d drags, least volume ratio %.3f at %s"
            % (self.name, sum(len(s) for s, _ in self.edits), ratio, tuple(round(x, 2) for x in place))
        )
        if preview:
            with open(os.path.join(preview, self.name + ".npy"), "wb") as file:
                header = "{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d, %d, 3), }" % self.lattice.points
                header += " " * (-(len(header) + 11) % 64) + "\n"
                file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode())
                nx, ny, nz = self.lattice.points
                for p in (self.lattice.control[i, j, k] for i in range(nx) for j in range(ny) for k in range(nz)):
                    file.write(struct.pack("<3d", *p))
            with open(os.path.join(preview, self.name + ".toml"), "w") as file:
                file.write(self.text(MESHES + "/", self.name + ".npy"))
        return ratio


def fig03(model):
    scene = Scene(
        "hu_fig03",
        [
            "A bottle given a new shape by four points, solved together: two pull its belly out near the foot, two press its waist.",
            "After Fig. 3 of Hu et al. (2001).",
        ],
        ((1.2, -9.5, 3.6), (0.0, 0.0, 1.72), 35.0),
        ((-4.0, -5.0, 7.0), 24.0),
        0.0,
        [("bottle", model, "green")],
        (4, 4, 6),
        None,
    )
    near = lambda r, z, s: min(model.vertices, key=lambda p: math.dist(p, (s * r, 0.0, z)))
    sources = [near(0.68, 0.6, 1.0), near(0.68, 0.6, -1.0), near(0.66, 1.95, 1.0), near(0.66, 1.95, -1.0)]
    moves = [(0.4, 0.0, -0.05), (-0.4, 0.0, -0.05), (-0.25, 0.0, 0.1), (0.25, 0.0, 0.1)]
    scene.drag(sources, moved(sources, moves))
    # The foot has moved a little as well.
    scene.floor = math.floor(1000.0 * min(scene.lattice.position(p)[2] for p in model.vertices)) / 1000.0
    return scene


def fig04(model):
    scene = Scene(
        "hu_fig04",
        [
            "A hollow cylinder turned into a cup by 48 points, solved together: rings of twelve at rim, belly, stem and foot.",
            "The walls are 60 tall quadrilaterals each: every bend is of the exact deformation. After Fig. 4 of Hu et al. (2001).",
        ],
        ((1.5, -6.8, 5.0), (0.0, 0.0, 1.2), 36.0),
        ((-4.0, -4.0, 7.0), 22.0),
        0.0,
        [("cup", model, "clay")],
        (6, 6, 8),
        ((-1.4, -1.4, 0.0), (1.4, 1.4, 2.4)),
    )
    sources, targets = [], []
    for z, radius, to in ((2.4, 1.45, 2.5), (1.5, 1.08, 1.6), (0.65, 0.42, 0.75), (0.0, 0.85, 0.0)):
        sources += [tuple(round(x, 12) for x in p) for p in circle(1.0, z, 12)]
        targets += [tuple(round(x, 6) for x in p) for p in circle(radius, to, 12)]
    scene.drag(sources, targets)
    return scene


FISH_LIGHT = ((5.0, -4.0, 6.0), 24.0)
FISH_CAMERA = ((8.6, -2.6, 2.1), (0.0, -0.1, 0.0), 36.0)


def fig05(letter, model, eyes):
    cells = {"a": 4, "b": 7, "c": 10}[letter]
    scene = Scene(
        "hu_fig05_%s" % letter,
        [
            "A fish stretched by four points, two near its mouth and two near its tail, with a lattice of 4x%dx4 control points."
            % cells,
            "The same drags act the more locally the finer the lattice is (hu_fig05_a, _b, _c). After Fig. 5 of Hu et al. (2001).",
        ],
        FISH_CAMERA,
        FISH_LIGHT,
        -1.15,
        [("fish", model, "gold"), ("eyes", eyes, "black")],
        (4, cells, 4),
        None,
    )
    sources = [
        vertex_near(model, p) for p in ((0.0, -2.0, 0.09), (0.0, -2.0, -0.08), (0.0, 2.1, 0.78), (0.0, 2.1, -0.74))
    ]
    moves = [(0.0, -0.6, 0.05), (0.0, -0.6, -0.05), (0.0, 0.4, 0.35), (0.0, 0.4, -0.35)]
    scene.drag(sources, moved(sources, moves))
    return scene


def vertex_near(model, place):
    return min(model.vertices, key=lambda p: math.dist(p, place))


def fig06(model, eyes):
    scene = Scene(
        "hu_fig06",
        [
            "A local deformation: the tips of the ears are pulled up by two points. The lattice covers the middle of the head,",
            "between chin and crown; its three outermost layers hold, so that the join is smooth.",
            "After Fig. 6 of Hu et al. (2001).",
        ],
        ((1.4, -7.4, 1.2), (0.0, 0.0, 0.05), 34.0),
        ((-4.0, -5.0, 6.0), 24.0),
        -1.25,
        [("head", model, "skin"), ("eyes", eyes, "black")],
        (18, 9, 9),
        ((-3.0, -1.5, -0.75), (3.0, 1.5, 1.2)),
        hold=3,
    )
    scene.drag(model.tips, moved(model.tips, [(0.15, 0.0, 0.55), (-0.15, 0.0, 0.55)]))
    return scene


def fig07(model, eyes):
    """One scene for each step of the decomposition: M = G^-1 D, and step q moves source q by G_qq M_q."""
    sources = [
        vertex_near(model, p) for p in ((0.0, -2.0, 0.08), (0.0, 0.05, 0.96), (0.0, 2.1, 0.78), (0.0, 2.1, -0.74))
    ]
    moves = [(0.0, -0.5, 0.15), (0.0, 0.15, 0.5), (0.0, 0.15, 0.4), (0.0, 0.45, -0.25)]
    targets = moved(sources, moves)
    make = lambda name, comment: Scene(
        name,
        comment,
        FISH_CAMERA,
        FISH_LIGHT,
        -1.15,
        [("fish", model, "gold"), ("eyes", eyes, "black")],
        (4, 4, 4),
        None,
    )
    joint = make("joint", [])
    multipliers, diagonal = joint.drag(sources, targets)
    rhos = [tuple(g * x for x in m) for g, m in zip(diagonal, multipliers)]
    print("hu_fig07: moves %s" % ["(%.3f, %.3f, %.3f)" % r for r in rhos])
    scenes = []
    for count in range(1, len(sources) + 1):
        scene = make(
            "hu_fig07_%d" % count,
            [
                "Four drags taken apart into single moves, step %d of 4: %s."
                % (
                    count,
                    (
                        "the mouth",
                        "then the dorsal fin",
                        "then the upper tip of the tail",
                        "then the lower tip of the tail",
                    )[count - 1],
                ),
                "Each move is by G_qq M_q with M = G^-1 D, not to its point's target: the last step brings all four to theirs.",
                "After Fig. 7 of Hu et al. (2001).",
            ],
        )
        for q in range(count):
            scene.drag([sources[q]], [add(scene.lattice.position(sources[q]), rhos[q])])
        scenes.append(scene)
    apart = max(abs(x) for a, p in scenes[-1].lattice.control.items() for x in sub(p, joint.lattice.control[a]))
    missed = max(abs(x) for s, t in zip(sources, targets) for x in sub(scenes[-1].lattice.position(s), t))
    print("hu_fig07: apart from the joint solution %.1e, from the targets %.1e" % (apart, missed))
    assert apart < 1e-12 and missed < 1e-12
    return scenes


def main():
    preview = sys.argv[2] if sys.argv[1:2] == ["--preview"] else None
    models = [make() for make in (bottle, cylinder, fish, fish_eyes, alien, alien_eyes)]
    for model in models:
        model.write()
    a_bottle, a_cylinder, a_fish, its_eyes, an_alien, alien_s_eyes = models
    scenes = [fig03(a_bottle), fig04(a_cylinder)] + [fig05(letter, a_fish, its_eyes) for letter in "abc"]
    scenes += [fig06(an_alien, alien_s_eyes)] + fig07(a_fish, its_eyes)
    folds = [scene.name for scene in scenes if scene.write(preview) <= 0.0]
    assert not folds, folds


if __name__ == "__main__":
    main()
