"""The ray queries of trimesh, by the names they have there, in double precision on the exact surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, rows
from ._object import Object
from ._scene import Hits, Scene

#: a direction along no edge that a modeller draws
_SIDEWAYS = (0.40395, 0.51937, 0.75297)


class RayMeshIntersector:
    """As `trimesh.ray.ray_triangle.RayMeshIntersector`; triangles are counted as the mesh has them.

    Parameters
    ----------
    mesh : trimesh.Trimesh, Mesh, Object or Scene
    """

    def __init__(self, mesh: Any) -> None:
        item = mesh if isinstance(mesh, (Object, Scene)) else Object(mesh)
        self.scene = item if isinstance(item, Scene) else Scene([item])

    def _all(
        self, ray_origins: Any, ray_directions: Any, multiple_hits: bool
    ) -> tuple[Hits, NDArray[np.int64], NDArray[np.int64]]:
        """Hits, the ray of each, and how many of the ray are before it."""
        if not multiple_hits:
            hits = self.scene.trace(ray_origins, ray_directions)
            return hits, np.arange(hits.t.size), np.zeros(hits.t.size, np.int64)
        every = self.scene.trace_all(ray_origins, ray_directions, once=True)
        index_ray = np.repeat(np.arange(len(every.offsets) - 1), np.diff(every.offsets))
        return every, index_ray, np.arange(every.t.size) - every.offsets[index_ray]

    def intersects_location(
        self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, **_: Any
    ) -> tuple[Floats, NDArray[np.int64], NDArray[np.int32]]:
        """Places of hits (n, 3), the ray of each (n,), and the triangle of each (n,)."""
        hits, index_ray, _before = self._all(ray_origins, ray_directions, multiple_hits)
        valid = hits.valid
        return hits.position[valid], index_ray[valid], hits.face[valid]

    def intersects_id(
        self,
        ray_origins: Any,
        ray_directions: Any,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
        **_: Any,
    ) -> tuple[NDArray[Any], ...]:
        """The triangle of each hit (n,), the ray of each (n,), and their places (n, 3) if they are asked for."""
        hits, index_ray, before = self._all(ray_origins, ray_directions, multiple_hits)
        keep = hits.valid if max_hits is None else hits.valid & (before < max_hits)
        found = (hits.face[keep], index_ray[keep])
        return (*found, hits.position[keep]) if return_locations else found

    def intersects_first(self, ray_origins: Any, ray_directions: Any) -> NDArray[np.int32]:
        """The first triangle that each ray hits (n,); -1 for a miss."""
        return self.scene.trace(ray_origins, ray_directions).face

    def intersects_any(self, ray_origins: Any, ray_directions: Any, **_: Any) -> NDArray[np.bool_]:
        """Whether each ray hits anything (n,)."""
        return self.scene.occluded(ray_origins, ray_directions)

    def contains_points(self, points: Any) -> NDArray[np.bool_]:
        """Which points are inside a closed surface (n,)."""
        places, _ = rows("points", points, 3)
        hits = self.scene.trace_all(places, _SIDEWAYS, once=True)
        inside: NDArray[np.bool_] = np.diff(hits.offsets) % 2 == 1
        return inside
