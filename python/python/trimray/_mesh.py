"""Polygon meshes."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, integers, numbers, rows
from ._trimray import Mesh as _Mesh

#: meshio's kinds of cell that are faces
_FACE_CELLS = ("triangle", "quad", "polygon")


class Mesh:
    """Vertices and polygonal faces.

    Parameters
    ----------
    vertices : array_like of shape (N, 3)
        Or an object of trimesh or meshio, which has faces too.
    faces : integers of shape (M, K), or sequence of sequences of integers
        The vertices of each face, counter-clockwise seen from outside, counted from 0; at least three.
    uvs : array_like of shape (N, 2), optional
        Texture coordinates of the vertices.
    normals : array_like of shape (N, 3), optional
        Normals of the vertices, for shading.

    Raises
    ------
    TypeError, ValueError
        Naming the argument that is wrong.
    """

    def __init__(self, vertices: Any, faces: Any = None, *, uvs: Any = None, normals: Any = None) -> None:
        if faces is None:
            vertices, faces = _parts(vertices)
        points = rows("vertices", vertices, 3)[0]
        corners, arities = _flat(faces)
        uvs = None if uvs is None else numbers("uvs", uvs, 2)
        normals = None if normals is None else numbers("normals", normals, 3)
        self._path: str | None = None
        self._attributes = (uvs, normals)
        self._native = _Mesh(points, corners, arities, uvs, normals)

    @classmethod
    def _load(cls, path: str | os.PathLike[str]) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._path = os.path.abspath(path)
        mesh._attributes = (None, None)
        mesh._native = _Mesh.load(os.fspath(path))
        return mesh

    @property
    def vertices(self) -> Floats:
        """Positions, a copy of shape (N, 3)."""
        return self._native.vertices()

    @property
    def faces(self) -> NDArray[np.int64] | list[NDArray[np.int64]]:
        """The vertices of each face: an array of shape (M, K), or a list where the faces have different numbers of corners."""
        corners, arities = self._native.faces()
        if arities.size and (arities == arities[0]).all():
            return corners.reshape(-1, int(arities[0]))
        return np.split(corners, np.cumsum(arities)[:-1])

    @property
    def bounds(self) -> Floats:
        """Least and greatest corner of the box around the vertices, of shape (2, 3)."""
        vertices = self.vertices
        return np.stack([vertices.min(axis=0), vertices.max(axis=0)])

    @property
    def notes(self) -> list[str]:
        """What the mesh's file holds that is not used."""
        return self._native.notes

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self._native.faces()[1])} faces)"

    def _write_obj(self, path: str) -> None:
        """Writes the mesh so that it is read as it is."""
        corners, arities = self._native.faces()
        uvs, normals = self._attributes
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in self.vertices.tolist()]
        lines += [] if uvs is None else [f"vt {u!r} {v!r}" for u, v in uvs.tolist()]
        lines += [] if normals is None else [f"vn {x!r} {y!r} {z!r}" for x, y, z in normals.tolist()]
        form = "{0}" if uvs is None and normals is None else "{0}/{0}" if normals is None else "{0}//{0}"
        form = "{0}/{0}/{0}" if uvs is not None and normals is not None else form
        words = [form.format(corner + 1) for corner in corners.tolist()]
        end = 0
        for arity in arities.tolist():
            lines.append(" ".join(["f", *words[end : end + arity]]))
            end += arity
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Reads a mesh file.

    Parameters
    ----------
    path : path
        A Wavefront OBJ file.

    Raises
    ------
    InputError
        Naming the file and each fault's line.
    """
    return Mesh._load(path)


def _parts(mesh: Any) -> tuple[Any, Any]:
    """Vertices and faces of another package's mesh."""
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "points") and hasattr(mesh, "cells"):
        blocks = [block.data for block in mesh.cells if block.type in _FACE_CELLS]
        return mesh.points, [face for block in blocks for face in block]
    raise TypeError("faces: are needed, for vertices is no mesh with vertices and faces")


def _flat(faces: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The corners of all faces in one run, and the number of each face's."""
    try:
        array = integers("faces", faces)
    except ValueError:
        # faces of different numbers of corners
        array = None
    if array is not None:
        if array.ndim != 2:
            raise ValueError(f"faces: has the shape {array.shape}, (M, K) is needed")
        return array.reshape(-1), np.full(len(array), array.shape[1], np.int64)
    try:
        lists = [integers("faces", face).reshape(-1) for face in faces]
    except TypeError as error:
        raise TypeError(f"faces: {error}".replace("faces: faces: ", "faces: ")) from None
    arities = np.array([len(face) for face in lists], np.int64)
    return (np.concatenate(lists) if lists else np.zeros(0, np.int64)), arities
