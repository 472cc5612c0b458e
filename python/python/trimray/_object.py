"""Objects: a shape, placed, deformed and represented."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _scene
from ._arrays import Floats
from ._document import FilePath
from ._lattice import Lattice
from ._mesh import Mesh
from ._tables import Extension, Material, Steps, Surface
from ._trimray import Scene as _Scene

if TYPE_CHECKING:
    from ._scene import Hits


@dataclass(frozen=True)
class Patch:
    """A trimmed Bézier patch.

    Attributes
    ----------
    cell : (int, int, int) or None
        Knot interval along each axis of the lattice; none outside of it.
    degree : (int, int)
    control_points : array of shape (m + 1, n + 1, 4)
        x, y, z, weight.
    frame : dict
        `origin`, `s`, `t`: the undeformed point of (s, t) is origin + s·frame["s"] + t·frame["t"].
    trim : list of dict
        For each polygon its input `face` and its `loop` of (s, t).
    """

    cell: tuple[int, int, int] | None
    degree: tuple[int, int]
    control_points: Floats
    frame: Mapping[str, Any]
    trim: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class Tessellation:
    """Triangles whose vertices are points of the exact surface.

    Attributes
    ----------
    vertices : array of shape (N, 3)
    triangles : integers of shape (M, 3)
    faces : integers of shape (M,)
        The input face of each triangle.
    uvs : array of shape (N, 2) or (0, 2)
    normals : array of shape (N, 3) or (0, 3)
    deviation : float
        Greatest distance found from the exact surface, in world units.
    """

    vertices: Floats
    triangles: NDArray[np.uint32]
    faces: NDArray[np.uint32]
    uvs: Floats
    normals: Floats
    deviation: float


@dataclass(frozen=True)
class Deviation:
    """How far triangles are from a surface: lengths in world units, angles in degrees; no distance is greater than `bound`."""

    max: float
    bound: float
    mean: float
    normal_max_degrees: float
    normal_mean_degrees: float


@dataclass(frozen=True)
class LatticeJacobian:
    """How the positions of hits depend on a lattice's control points.

    Attributes
    ----------
    indices : integers of shape (..., M)
        Places of control points in `control_points.reshape(-1, 3)`.
    weights : array of shape (..., M)
        0 for misses and for points that the lattice does not move.
    matrix : array of shape (..., 3, 3) or None
        The partials of the lattices that follow; none if there are none. The derivative of a hit's position by a control point is
        its weight times this matrix, or times the identity.
    count : int
        Number of control points.
    """

    indices: NDArray[np.int64]
    weights: Floats
    matrix: Floats | None
    count: int

    def tocsr(self) -> Any:
        """The weights as SciPy's sparse matrix of shape (hits, control points), which times control points gives positions."""
        from scipy.sparse import csr_array

        indices, weights = (array.reshape(-1, array.shape[-1]) for array in (self.indices, self.weights))
        starts = np.arange(len(indices) + 1) * indices.shape[1]
        return csr_array((weights.ravel(), indices.ravel(), starts), shape=(len(indices), self.count))


class Geometry:
    """What objects of a scene and objects by themselves have in common."""

    def _built(self) -> tuple[_Scene, int]:
        raise NotImplementedError

    @property
    def bounds(self) -> Floats:
        """Least and greatest corner of a box around the deformed surface, of shape (2, 3): too large by 1e-4 of its size at most."""
        scene, index = self._built()
        return np.array(scene.object_bounds(index))

    def info(self) -> dict[str, Any]:
        """What the deformation made, as `trimray info --json` tells of the object."""
        scene, index = self._built()
        found: dict[str, Any] = json.loads(scene.info())["objects"][index]
        return found

    def patches(self) -> list[Patch]:
        """The exact patches."""
        scene, index = self._built()
        found = json.loads(scene.patches())["objects"][index]["patches"]
        return [_patch(**patch) for patch in found]

    def tessellate(self, tolerance: float | None = None, *, level: int | None = None) -> Tessellation:
        """Triangles close to the surface.

        Parameters
        ----------
        tolerance : float, optional
            Greatest distance from the surface in world units. Default: 1e-4 of the object's diagonal.
        level : int, optional
            Instead: each triangle of each sub-polygon is cut into 4 this many times.
        """
        scene, index = self._built()
        return Tessellation(**scene.tessellate(index, tolerance, level))

    def deviation(self, other: Geometry) -> Deviation:
        """How far the triangles of `other`, the same object by another `method`, are from this exact one, certified within 1 %."""
        scene, index = self._built()
        return Deviation(**scene.deviation(index, *other._built()))


class SceneObject(Geometry):
    """An object of a scene, as the scene has it.

    Attributes
    ----------
    name : str
    """

    def __init__(self, scene: _Scene, index: int, name: str) -> None:
        self._place = (scene, index)
        self.name = name

    def _built(self) -> tuple[_Scene, int]:
        return self._place

    def __repr__(self) -> str:
        return f"SceneObject({self.name!r})"


class Object(Geometry):
    """A shape, placed in the world, then deformed.

    Parameters
    ----------
    shape : Mesh, Surface or path
        Also a mesh of trimesh or meshio.
    deform : sequence of Lattice or Extension
        In the order they apply.
    material : Material, optional
        Default: diffuse.
    name : str, optional
        Unique in a scene.
    transform : list of dict, optional
        Steps {"scale": s}, {"rotate": {"axis": …, "angle": degrees}}, {"translate": (x, y, z)} before deforming.
    normals : {"face", "vertex"}
        Whether shading uses the surface's normals or the mesh's, carried along.
    method : str
        "exact", "pointwise:L", "adaptive:TOL" or "triangular".
    materials : dict, optional
        Materials for names that the mesh's file gives.
    """

    def __init__(
        self,
        shape: Any,
        deform: Sequence[Lattice | Extension] = (),
        material: Material | None = None,
        *,
        name: str | None = None,
        transform: Steps | None = None,
        normals: str | None = None,
        method: str | None = None,
        materials: Mapping[str, Material] | None = None,
    ) -> None:
        is_path = isinstance(shape, (str, os.PathLike))
        self.shape: Mesh | Surface | FilePath = (
            FilePath(os.fspath(shape)) if is_path else shape if isinstance(shape, (Mesh, Surface)) else Mesh(shape)
        )
        self.deform = [deform] if isinstance(deform, (Lattice, Extension)) else list(deform)
        self.material = material
        self.materials = materials
        self.name = name
        self.settings = {"transform": transform, "normals": normals, "method": method}
        self._cache: tuple[Any, _Scene] | None = None

    def __repr__(self) -> str:
        return f"Object({self.shape!r}, deform={self.deform!r}, name={self.name!r})"

    def _built(self) -> tuple[_Scene, int]:
        parts = _scene.Parts([self])
        state = (parts.text, parts.state())
        if self._cache is None or self._cache[0] != state:
            self._cache = (state, parts.build(None, False))
        return self._cache[1], 0

    def export(self, path: str | os.PathLike[str], **flags: Any) -> None:
        """Writes the object for other programs, as `trimray export` does.

        Parameters
        ----------
        path : path
            The ending tells what: .step, .json, .obj, .ply, .npy.
        **flags
            The command's, without hyphens: `tolerance=1e-5`, `unit="mm"`, …

        Raises
        ------
        InputError, OutputError
        """
        self._built()[0].export(_scene.export_flags(path, flags))

    def jacobian_wrt_lattice(self, hits: Hits, lattice: int = 0) -> LatticeJacobian:
        """The exact derivative of hits' positions by the control points of a lattice of this object.

        The points of the surface that the rays hit are followed, not the rays. The lattices are taken as they are now.

        Parameters
        ----------
        hits : Hits
            Of a scene that has this object.
        lattice : int
            Index in `deform`.

        Raises
        ------
        ValueError
            If the scene has no such object, or if its deformations are not all lattices with bounds of their own.
        """
        boxes = [box for box in self.deform if isinstance(box, Lattice)]
        if len(boxes) < len(self.deform) or not boxes:
            raise ValueError("deform: the object is not deformed by lattices alone")
        own = [index for index, other in enumerate(hits._objects) if other is self]
        if not own:
            raise ValueError("hits: are of a scene without this object")
        mine = np.isin(hits.object, own)
        places = np.where(mine[..., None], hits.rest, np.nan)
        for box in boxes[:lattice]:
            places = box(places)
        indices, weights = boxes[lattice].derivatives(places)
        matrix: Floats | None = None
        for before, box in zip(boxes[lattice:], boxes[lattice + 1 :]):
            places = before(places)
            step = box.jacobian(places)
            matrix = step if matrix is None else step @ matrix
        return LatticeJacobian(indices, weights, matrix, int(np.prod(boxes[lattice].weights.shape)))


def _patch(cell: Any, degree: Any, control_points: Any, frame: Any, trim: Any, **_: Any) -> Patch:
    m, n = degree
    points = np.array(control_points).reshape(m + 1, n + 1, 4)
    return Patch(None if cell is None else tuple(cell), (m, n), points, frame, trim)
