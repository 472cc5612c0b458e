"""Writes the meshes of the scenes here: scenes/meshes/*.obj. They are in the repository; run this to change them.

    python meshes.py
"""

from math import cos, pi, sin
from pathlib import Path

FOLDER = Path(__file__).parent / "scenes" / "meshes"


def write(name, title, vertices, coordinates, faces, normals=()):
    """An OBJ file; faces are lists of (vertex, texture coordinate), counted from 0; normals are the vertices'."""
    lines = [f"# {title}"]
    lines += ["v " + " ".join(f"{x:.9g}" for x in vertex) for vertex in vertices]
    lines += ["vt " + " ".join(f"{x:.9g}" for x in pair) for pair in coordinates]
    lines += ["vn " + " ".join(f"{x:.9g}" for x in normal) for normal in normals]
    normal = lambda v: f"/{v + 1}" if normals else ""
    lines += ["f " + " ".join(f"{v + 1}/{t + 1}{normal(v)}" for v, t in face) for face in faces]
    (FOLDER / name).write_text("\n".join(lines) + "\n", encoding="utf-8")


def grid(name, title, n, x, y):
    """A square of n × n faces from -1 to 1, face up."""
    steps = [i / n for i in range(n + 1)]
    pairs = [(u, v) for v in steps for u in steps]
    corner = lambda i, j: (j * (n + 1) + i,) * 2
    faces = [
        [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)] for j in range(n) for i in range(n)
    ]
    write(name, title, [(x * (2 * u - 1), y * (2 * v - 1), 0) for u, v in pairs], pairs, faces)


def cube():
    """From -0.5 to 0.5 across, standing on z = 0; every face has the whole texture."""
    vertices = [(x, y, z) for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (3, 2, 6, 7), (2, 0, 4, 6), (1, 3, 7, 5)]
    faces = [[(vertex, k) for k, vertex in enumerate(side)] for side in sides]
    write("cube.obj", "a cube of 6 faces", vertices, [(0, 0), (1, 0), (1, 1), (0, 1)], faces)


def ball(rings=8, sectors=12):
    """A sphere of radius 0.5 on z = 0, of flat quads and triangles; u around, v from pole to pole."""
    vertices = [(0, 0, 0), (0, 0, 1)]
    coordinates = []
    for i in range(1, rings):
        for j in range(sectors):
            theta, phi = pi * i / rings, 2 * pi * j / sectors
            vertices.append((0.5 * sin(theta) * cos(phi), 0.5 * sin(theta) * sin(phi), 0.5 - 0.5 * cos(theta)))
    coordinates = [(j / sectors, i / rings) for i in range(rings + 1) for j in range(sectors + 1)]

    def corner(i, j):
        pole = {0: 0, rings: 1}.get(i)
        vertex = 2 + (i - 1) * sectors + j % sectors if pole is None else pole
        return vertex, i * (sectors + 1) + j

    faces = []
    for i in range(rings):
        for j in range(sectors):
            face = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)]
            # the outside is counter-clockwise; at the poles two corners are one
            faces.append([c for k, c in enumerate(face) if c[0] not in [d[0] for d in face[:k]]])
    write("ball.obj", "a ball of flat faces", vertices, coordinates, faces)
    normals = [(2 * x, 2 * y, 2 * z - 1) for x, y, z in vertices]
    # of quads two renderers may make different triangles, between whose normals they interpolate differently
    triangles = [[face[0], face[k], face[k + 1]] for face in faces for k in range(1, len(face) - 1)]
    write("ball_normals.obj", "a ball of triangles with a sphere's normals", vertices, coordinates, triangles, normals)


grid("floor.obj", "a square, face up", 1, 3, 3)
grid("sheet.obj", "a square of 3 x 3 faces, face up", 3, 1, 1)
cube()
ball()
