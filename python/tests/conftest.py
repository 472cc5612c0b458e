"""What the tests share."""

import warnings

import numpy as np
import pytest

import trimray as tr


@pytest.fixture
def cube() -> tr.Mesh:
    """The unit cube of six squares."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    squares = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return tr.Mesh(corners, squares)


@pytest.fixture
def box(cube: tr.Mesh) -> tr.Lattice:
    """A twisted lattice around the cube."""
    return tr.Lattice(degree=(2, 2, 3), points=(4, 4, 5), bounds=cube.bounds).twist("z", 40)


@pytest.fixture
def item(cube: tr.Mesh, box: tr.Lattice) -> tr.Object:
    """The twisted cube."""
    return tr.Object(cube, deform=[box], material=tr.Diffuse(reflectance=(0.6, 0.5, 0.4)), name="cube")


@pytest.fixture
def scene(item: tr.Object) -> tr.Scene:
    """The twisted cube, seen from the side."""
    camera = tr.Perspective(origin=(3, -4, 2), target=(0.5, 0.5, 0.5), fov=25)
    light = tr.Constant(1.0)
    return tr.Scene([item], camera=camera, lights=[light], film={"size": [24, 16]}, render={"spp": 4})


@pytest.fixture
def rays() -> tuple[np.ndarray, np.ndarray]:
    """Rays that mostly hit the cube."""
    generator = np.random.default_rng(7)
    origins = 0.5 + 2 * generator.normal(size=(3000, 3))
    return origins, generator.uniform(size=(3000, 3)) - origins


@pytest.fixture(autouse=True)
def no_warnings():
    """Warnings are mistakes, unless a test is of one."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
