"""Rays: shapes, kinds and errors of arrays, and the same bits as the program."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import trimray as tr

NAMES = ["t", "object", "face", "patch", "st", "uv", "rest", "position", "normal", "dp_ds", "dp_dt"]


def same(a, b) -> bool:
    """Whether arrays are equal to the bit."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def run(*arguments):
    """The program of the package."""
    return subprocess.run([sys.executable, "-m", "trimray", *map(str, arguments)], check=True, capture_output=True)


def test_a_cube_is_hit_where_arithmetic_says(cube):
    hits = tr.Scene(tr.Object(cube)).trace([[0.3, 0.4, -2.0], [5, 5, 5]], (0, 0, 2))
    assert hits.t.tolist() == [1.0, np.inf]
    assert hits.valid.tolist() == [True, False]
    assert hits.face.tolist() == [4, -1] and hits.face.dtype == np.int32
    assert hits.normal[0].tolist() == [0, 0, -1]
    assert np.isnan(hits.position[1]).all()


def test_hits_are_those_of_the_program_to_the_bit(scene, rays, tmp_path):
    scene.save(tmp_path / "s.toml")
    np.save(tmp_path / "r.npy", np.hstack(rays))
    run("trace", tmp_path / "s.toml", "--rays", tmp_path / "r.npy", "-o", tmp_path / "h.npz")
    hits, want = scene.trace(*rays), np.load(tmp_path / "h.npz")
    assert sorted(want.files) == sorted(NAMES)
    assert 0.3 < hits.valid.mean() < 1
    assert all(same(getattr(hits, name), want[name]) for name in NAMES)
    run("trace", tmp_path / "s.toml", "--rays", tmp_path / "r.npy", "-o", tmp_path / "a.npz", "--all")
    hits, want = scene.trace_all(*rays), np.load(tmp_path / "a.npz")
    assert all(same(getattr(hits, name), want[name]) for name in [*NAMES, "offsets"])
    hits.save(tmp_path / "own.npz")
    assert all(same(np.load(tmp_path / "own.npz")[name], want[name]) for name in want.files)
    run("trace", tmp_path / "s.toml", "--rays", tmp_path / "r.npy", "-o", tmp_path / "any.npz", "--any")
    assert same(scene.occluded(*rays), np.load(tmp_path / "any.npz")["hit"])


def test_a_loaded_scene_is_the_saved_one(scene, rays, tmp_path):
    scene.save(tmp_path / "s.toml")
    loaded = tr.load(tmp_path / "s.toml")
    assert [item.name for item in loaded.objects] == ["cube"]
    assert all(same(getattr(scene.trace(*rays), name), getattr(loaded.trace(*rays), name)) for name in NAMES)


def test_all_hits_begin_where_offsets_say(scene, rays):
    first, hits = scene.trace(*rays), scene.trace_all(*rays)
    assert len(hits.offsets) == len(rays[0]) + 1 and hits.offsets[-1] == len(hits.t)
    begins = hits.offsets[:-1][first.valid]
    assert same(hits.t[begins], first.t[first.valid])


FLOATS = st.floats(-4, 4, width=16)


@st.composite
def laid_out(draw):
    """An array of a drawn shape, kind, order and strides, and the same as plain float64."""
    shape = draw(arrays.array_shapes(max_dims=3, min_side=0, max_side=4)) + (3,)
    kind = draw(st.sampled_from(["<f8", ">f8", "f4", "f2", "i4", "u1", "?", "g"]))
    plain = draw(arrays.arrays(np.float64, shape, elements=FLOATS))
    with np.errstate(invalid="ignore"):
        array = plain.astype(kind)
    plain = array.astype(np.float64)
    layout = draw(st.sampled_from(["C", "F", "reversed", "gaps", "unaligned", "read-only", "list"]))
    if layout == "F":
        array = np.asfortranarray(array)
    elif layout == "reversed":
        array = array[..., ::-1].copy()[..., ::-1]
    elif layout == "gaps":
        wide = np.zeros(shape[:-1] + (7,), array.dtype)
        wide[..., 1:6:2] = array
        array = wide[..., 1:6:2]
    elif layout == "unaligned":
        packed = np.zeros(shape, np.dtype([("pad", "u1"), ("x", array.dtype)], align=False))
        packed["x"] = array
        array = packed["x"]
    elif layout == "read-only":
        array.flags.writeable = False
    elif layout == "list" and array.size:
        array = array.tolist()
    return array, plain


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(laid_out())
def test_arrays_of_any_layout_give_the_right_answer(box, scene, drawn):
    array, plain = drawn
    flat = np.ascontiguousarray(plain).reshape(-1, 3)
    assert same(box(array), box(flat).reshape(plain.shape))
    assert same(box.jacobian(array), box.jacobian(flat).reshape(*plain.shape, 3))
    direction = (0.1, 0.2, -1.0)
    hits, want = scene.trace(array, direction), scene.trace(flat, np.tile(direction, (len(flat), 1)))
    for name in NAMES:
        one, other = getattr(hits, name), getattr(want, name)
        assert same(one, other.reshape(plain.shape[:-1] + other.shape[1:]))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(arrays.arrays(st.sampled_from(["U3", "c16", "M8[s]", "m8[s]", "S2"]), arrays.array_shapes(max_dims=2)))
def test_arrays_of_other_kinds_are_refused_by_name(box, scene, array):
    for name, call in [
        ("points", lambda: box(array)),
        ("origins", lambda: scene.trace(array, (0, 0, 1))),
        ("directions", lambda: scene.occluded((0, 0, 1), array)),
        ("vertices", lambda: tr.Mesh(array, [[0, 1, 2]])),
    ]:
        with pytest.raises((TypeError, ValueError), match=f"^{name}: "):
            call()


@pytest.mark.parametrize(
    ("origins", "directions", "message"),
    [
        (np.zeros(2), (0, 0, 1), r"^origins: has the shape \(2,\), \(\.\.\., 3\) is needed"),
        (0.0, (0, 0, 1), r"^origins: has the shape \(\)"),
        (np.zeros((4, 3)), np.zeros((5, 3)), r"^origins: of shape \(4, 3\), which does not go with"),
        ([(0, 0, np.nan)], (0, 0, 1), "^origins: row 0: not finite"),
        ((0, 0, 0), [(0, 0, 1), (0, np.inf, 1)], "^directions: row 1: not finite"),
        ((0, 0, 0), (0, 0, 0), "^directions: row 0: the direction .* has no usable length"),
        ([[0, 0], [0, 0, 1]], (0, 0, 1), "^origins: "),
    ],
)
def test_rays_that_are_none_are_refused(scene, origins, directions, message):
    with pytest.raises(ValueError, match=message):
        scene.trace(origins, directions)


def test_eight_threads_trace_one_scene(scene, rays):
    want = scene.trace(*rays)
    origins, directions = (np.tile(array, (10, 1)) for array in rays)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: scene.trace(origins, directions), range(24)))
    for hits in found:
        assert all(same(getattr(hits, name)[: len(rays[0])], getattr(want, name)) for name in NAMES)


def test_the_names_of_trimesh(cube):
    trimesh = pytest.importorskip("trimesh")
    solid = trimesh.creation.icosphere(subdivisions=2)
    ours, theirs = tr.trimesh.RayMeshIntersector(solid), trimesh.ray.ray_triangle.RayMeshIntersector(solid)
    generator = np.random.default_rng(5)
    origins = 3 * generator.normal(size=(200, 3))
    directions = generator.uniform(-0.9, 0.9, size=(200, 3)) - origins
    assert (ours.intersects_first(origins, directions) == theirs.intersects_first(origins, directions)).all()
    assert (ours.intersects_any(origins, directions) == theirs.intersects_any(origins, directions)).all()
    for several in (True, False):
        found = [which.intersects_location(origins, directions, multiple_hits=several) for which in (ours, theirs)]
        placed = [np.lexsort((triangles, rays)) for _, rays, triangles in found]
        for part in range(3):
            a, b = (parts[part][order] for parts, order in zip(found, placed))
            assert np.allclose(a, b, atol=1e-6)
    triangles, rays_of, places = ours.intersects_id(origins, directions, max_hits=1, return_locations=True)
    assert len(triangles) == len(rays_of) == len(places) == np.count_nonzero(ours.intersects_any(origins, directions))
    points = generator.uniform(-1.2, 1.2, size=(300, 3))
    assert (ours.contains_points(points) == theirs.contains_points(points)).all()
