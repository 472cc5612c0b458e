"""Lattices: live control points, the map and its derivatives."""

import numpy as np
import pytest

import trimray as tr


def test_the_first_lattice_is_the_identity(box):
    points = np.random.default_rng(1).uniform(-0.2, 1.2, size=(5, 7, 3))
    identity = box.identity
    assert np.allclose(identity(points), points, atol=1e-15, rtol=0)
    assert np.allclose(identity.jacobian(points), np.eye(3), atol=1e-14)
    assert identity.contains([[0.5, 0.5, 0.5], [2, 0, 0]]).tolist() == [True, False]
    # outside is kept
    assert box((3.0, 4.0, 5.0)).tolist() == [3, 4, 5]


def test_control_points_are_live(box):
    before = box((0.5, 0.5, 0.5))
    box.control_points[1, 2, 3] += 0.1
    box.control_points += 1.0
    after = box((0.5, 0.5, 0.5))
    weight = 0.1 * box.derivatives((0.5, 0.5, 0.5))[1][box.derivatives((0.5, 0.5, 0.5))[0] == (1 * 4 + 2) * 5 + 3]
    assert np.allclose(after, before + 1.0 + weight, atol=1e-14)
    assert box.control_points.shape == (4, 4, 5, 3) and box.control_points.base is not None
    other = box.copy()
    other.control_points[:] = 0
    assert not np.array_equal(other.control_points, box.control_points)


def test_partials_are_those_of_differences(box):
    box.weights[1, 1, 2] = 2.0
    points = np.random.default_rng(2).uniform(0.1, 0.9, size=(50, 3))
    step = 1e-6
    for axis in range(3):
        offset = step * np.eye(3)[axis]
        slope = (box(points + offset) - box(points - offset)) / (2 * step)
        assert np.allclose(box.jacobian(points)[..., axis], slope, atol=1e-8)


def test_drags_arrive(box):
    found = box.drag([[0.5, 0.5, 1.0], [0.2, 0.5, 0.5]], [[0.5, 0.6, 1.4], [0.1, 0.5, 0.5]])
    assert found.rank == 2 and found.condition >= 1 and found.objective > 0
    assert np.allclose(box([[0.5, 0.5, 1.0], [0.2, 0.5, 0.5]]), [[0.5, 0.6, 1.4], [0.1, 0.5, 0.5]], atol=1e-13)
    assert np.allclose(found.reached[0], [0.5, 0.6, 1.4], atol=1e-13)
    with pytest.raises(tr.InputError, match="cannot all be met"):
        box.drag([[0.5, 0.5, 0.5]] * 2, [[0, 0, 0], [1, 1, 1]])
    assert box.drag([[0.5, 0.5, 0.5]] * 2, [[0, 0, 0], [1, 1, 1]], least_squares=True).rank == 1


def test_edits_are_those_of_a_scene_file(cube, tmp_path):
    points = np.random.default_rng(3).uniform(size=(20, 3))
    rays = (points + [0, 0, 5], (0, 0, -1))
    kinds = {"bounds": cube.bounds}, {}
    scenes = []
    for bounds in kinds:
        box = tr.Lattice(degree=(2, 2, 2), points=(4, 4, 4), **bounds)
        box.twist("z", 30).taper("x", (0.8, 1.1)).bulge("y", 0.2).bend("z", 20, "-x").move((1, 2, 3), by=(0, 0, 0.1))
        box.drag([0.5, 0.5, 1.0], [0.5, 0.6, 1.2])
        scenes.append(tr.Scene([tr.Object(cube, deform=[box])]))
    # without bounds the edits are of the scene, and the box is the object's: the same
    assert scenes[0].trace(*rays).t.tobytes() == scenes[1].trace(*rays).t.tobytes()
    with pytest.raises(ValueError, match="^bounds: "):
        tr.Lattice().control_points


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: tr.Lattice(degree=(9, 2, 2), bounds=[[0, 0, 0], [1, 1, 1]]), "degree must be three integers from 1 to"),
        (lambda: tr.Lattice(points=(2, 6, 6), bounds=[[0, 0, 0], [1, 1, 1]]), "points must be more than the degree"),
        (lambda: tr.Lattice(bounds=[[0, 0, 0], [0, 1, 1]]), "bounds are a box with no extent along x"),
        (lambda: tr.Lattice(bounds=[[0, 0, 0], [1, 1, 1]]).twist("w", 3), "unknown axis"),
    ],
)
def test_what_is_wrong_is_said_as_the_program_says_it(make, message):
    with pytest.raises(tr.SceneError, match=message):
        make()


def test_held_points_stay(cube):
    box = tr.Lattice(points=(6, 6, 6), bounds=cube.bounds, hold=1)
    box.control_points[0, 0, 0] += 1
    with pytest.raises(tr.InputError, match="hold keeps"):
        box((0.5, 0.5, 0.5))


def test_points_outside_can_be_an_error(cube):
    box = tr.Lattice(bounds=cube.bounds, outside="error")
    with pytest.raises(ValueError, match="^points: 1 are outside the lattice's box, the first in row 1"):
        box([[0.5, 0.5, 0.5], [2, 0, 0]])


def test_derivatives_of_hits_by_control_points(cube, box, rays):
    second = tr.Lattice(degree=(1, 2, 1), points=(3, 4, 3), bounds=[[-1, -1, -1], [2, 2, 2]]).bend("y", 30, "x")
    item = tr.Object(cube, deform=[box, second])
    hits = tr.Scene([tr.Object(tr.Surface("sphere", center=(9, 9, 9), radius=1)), item]).trace(*rays)
    assert hits.valid.sum() > 500
    for index in (0, 1):
        found = item.jacobian_wrt_lattice(hits, index)
        assert (found.matrix is None) == (index == 1)
        lattice = item.deform[index]
        moves = np.random.default_rng(4).normal(size=lattice.control_points.shape)
        predicted = (found.weights[..., None] * moves.reshape(-1, 3)[found.indices]).sum(axis=-2)
        if found.matrix is not None:
            predicted = (found.matrix @ predicted[..., None])[..., 0]
        step = 1e-6
        before = second(box(hits.rest))
        lattice.control_points += step * moves
        after = second(box(hits.rest))
        lattice.control_points -= step * moves
        assert np.allclose(before[hits.valid], hits.position[hits.valid], atol=1e-12)
        assert np.allclose(((after - before) / step)[hits.valid], predicted[hits.valid], atol=1e-4)
        assert (found.weights[~hits.valid] == 0).all()
    with pytest.raises(ValueError, match="^hits: "):
        tr.Object(cube, deform=[box]).jacobian_wrt_lattice(hits)
