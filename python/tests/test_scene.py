"""Scenes and objects: what they are made of, errors, files, and memory."""

import gc
import os
import subprocess
import sys
import warnings

import numpy as np
import pytest

import trimray as tr


def test_meshes_come_from_many_places(cube, tmp_path):
    assert cube.vertices.shape == (8, 3) and cube.faces.shape == (6, 4)
    assert cube.bounds.tolist() == [[0, 0, 0], [1, 1, 1]]
    mixed = tr.Mesh(cube.vertices, [[0, 1, 3], [0, 3, 2], [4, 6, 7, 5]])
    assert [len(face) for face in mixed.faces] == [3, 3, 4]
    assert len(tr.Scene(tr.Object(mixed)).objects[0].patches()) >= 2

    class Block:
        type, data = "quad", cube.faces

    class Other:
        points, cells = cube.vertices, [Block]

    assert np.array_equal(tr.Mesh(Other).faces, cube.faces)
    cube._write_obj(str(tmp_path / "cube.obj"))
    loaded = tr.load_mesh(tmp_path / "cube.obj")
    # vertices of files are in the order of their use
    assert np.array_equal(loaded.vertices[loaded.faces], cube.vertices[cube.faces])
    assert np.allclose(tr.Scene([tr.Object(tmp_path / "cube.obj")]).bounds, cube.bounds, atol=2e-4)


@pytest.mark.parametrize(
    ("vertices", "faces", "kind", "message"),
    [
        (np.zeros((3, 3)), [[0, 1, 3]], ValueError, "^faces: refers to vertex 3, but there are 3"),
        (np.zeros((3, 3)), [[0, 1]], ValueError, "face 0 has 2 corners"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], TypeError, "^faces: holds float64"),
        (np.zeros((3, 3)), 5, ValueError, "^faces: has the shape"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], ValueError, "position 0 is not finite"),
        (np.zeros((3, 2)), [[0, 1, 2]], ValueError, "^vertices: has the shape"),
        ("cube", None, TypeError, "^faces: are needed"),
    ],
)
def test_meshes_that_are_none_are_refused(vertices, faces, kind, message):
    with pytest.raises(kind, match=message):
        tr.Mesh(vertices, faces)


def test_errors_are_the_programs(cube, tmp_path):
    with pytest.raises(tr.SceneError, match='unknown key "reflectence" in .*did you mean "reflectance"'):
        material = tr.Diffuse()
        material.parameters["reflectence"] = 0.5
        tr.Scene(tr.Object(cube, material=material))
    with pytest.raises(tr.SceneError) as caught:
        tr.Scene([tr.Object(cube, material=tr.Diffuse(reflectance=2.0)), tr.Object(cube, method="exactly")])
    assert len(str(caught.value).splitlines()) == 2
    (tmp_path / "s.toml").write_text('[[object]]\nname = "cube"\nmash = "cube.obj"\n')
    with pytest.raises(tr.SceneError) as caught:
        tr.load(tmp_path / "s.toml")
    run = subprocess.run([sys.executable, "-m", "trimray", "info", tmp_path / "s.toml"], capture_output=True, text=True)
    assert run.returncode == 2
    assert run.stderr == "".join(f"trimray: {line}\n" for line in str(caught.value).splitlines())
    with pytest.raises(tr.InputError, match="no.obj"):
        tr.load_mesh(tmp_path / "no.obj")
    assert issubclass(tr.SceneError, tr.Error) and issubclass(tr.OutOfMemoryError, MemoryError)


def test_odd_meshes_are_warned_of(cube):
    bent = cube.vertices
    bent[7] += 0.2
    with pytest.warns(tr.SceneWarning, match="object 1: "):
        tr.Scene(tr.Object(tr.Mesh(bent, cube.faces)))


def test_everything_has_a_place_in_a_scene(cube, tmp_path):
    ball = tr.Object(
        tr.Surface("sphere", radius=0.3),
        tr.Extension("operator", [{"bound": "(u-0.5)^2 + (v-0.5)^2 - 0.04", "index": 3, "h": [0.2, 0.2, 0.2]}]),
        material=tr.RoughConductor("Au", alpha=0.2),
        transform=[{"translate": (2, 0, 0)}],
    )
    board = tr.Checkerboard(0.1, (0.9, 0.8, 0.7))
    uvs = cube.vertices[:, :2]
    die = tr.Object(
        tr.Mesh(cube.vertices, cube.faces, uvs=uvs, normals=cube.vertices - 0.5),
        material=tr.Principled(board, roughness=0.4),
        normals="vertex",
        name="die 🎲",
    )
    lamp = tr.Object(cube, transform=[{"scale": 0.1}, {"translate": (0, 0, 3)}])
    lights = [
        tr.Constant((0.1, 0.1, 0.2)),
        tr.Point((3, 3, 3), 2.0),
        tr.Directional((0, 0, -1), 1.0),
        tr.Area("rectangle", 3.0, to_world=[{"translate": (0, 0, 4)}]),
        tr.Area("object", 5.0, object=lamp),
    ]
    camera = tr.ThinLens((4, -5, 3), (1, 0.5, 0.5), aperture_radius=0.01, focus_distance=6)
    film = {"size": np.array([16, 12]), "filter": "gaussian"}
    scene = tr.Scene([ball, die, lamp], camera, lights, film=film, render={"spp": 2, "aovs": ["uv"]})
    scene.save(tmp_path / "s.toml")
    a, b = scene.render(), tr.load(tmp_path / "s.toml").render()
    assert np.array_equal(a, b) and np.array_equal(a.layers["uv"], b.layers["uv"])
    assert np.isfinite(a).all() and a[..., 3].max() == 1
    assert tr.Scene(die, lights=[]).render(spp=1, size=(8, 8))[..., :3].max() == 0
    assert tr.Scene(die).render(spp=1, size=(8, 8))[..., :3].max() > 0


def test_objects_know_their_patches_and_triangles(item, scene, tmp_path):
    patches = item.patches()
    info = item.info()
    assert info["patches"] == len(patches) and info["injective"]
    for patch in patches:
        m, n = patch.degree
        assert patch.control_points.shape == (m + 1, n + 1, 4)
    mesh = item.tessellate(1e-3)
    assert mesh.deviation <= 1e-3 and mesh.triangles.max() == len(mesh.vertices) - 1
    assert len(item.tessellate(level=1).triangles) > 12 and len(mesh.faces) == len(mesh.triangles)
    assert np.allclose(item.bounds, scene.bounds)
    rough = tr.Object(item.shape, item.deform, method="pointwise:1")
    found = item.deviation(rough)
    assert 0 < found.mean < found.max <= found.bound < 0.2
    for name in ("x.step", "x.json", "x.obj", "x.ply", "x.npy"):
        item.export(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 0
    assert np.array_equal(np.load(tmp_path / "x.npy")[..., :3], item.deform[0].control_points)
    scene.export(tmp_path / "mitsuba", format="mitsuba")
    with pytest.raises(tr.InputError, match="unknown kind of export"):
        item.export(tmp_path / "x.iges")
    with pytest.raises(tr.InputError, match="--tolerance"):
        item.export(tmp_path / "x.ply", tolerance=-1)


def test_objects_follow_their_lattice_and_scenes_do_not(item, scene, rays):
    before, bounds = scene.trace(*rays), item.bounds
    item.deform[0].control_points[..., 2] += 3
    assert np.allclose(item.bounds, bounds + [0, 0, 3])
    assert scene.trace(*rays).t.tobytes() == before.t.tobytes()


def resident() -> int:
    """Bytes of memory that the process has."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is told otherwise here")
def test_memory_does_not_grow(item, rays):
    def work(times):
        for _ in range(times):
            scene = tr.Scene([item])
            hits = scene.trace(rays[0][:50], rays[1][:50])
            item.jacobian_wrt_lattice(hits)
        gc.collect()

    work(100)
    before = resident()
    work(400)
    assert resident() - before < 4 << 20


def test_scenes_that_are_odd_do_not_stay(cube):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(20):
            with pytest.raises(tr.SceneError):
                tr.Scene([tr.Object(cube, method="no")])
