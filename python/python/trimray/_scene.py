"""Scenes: objects, a camera and lights, to trace rays through and to render."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, rays
from ._document import FilePath, headed, value_text
from ._errors import InputError, SceneWarning
from ._lattice import Lattice
from ._mesh import Mesh
from ._picture import Picture
from ._tables import Camera, Light, Material
from ._trimray import Picture as _Picture
from ._trimray import Scene as _Scene

if TYPE_CHECKING:
    from ._object import Object, SceneObject


class Hits:
    """What rays hit: arrays whose leading shape is that of the rays.

    Attributes
    ----------
    t : array of shape (...)
        Ray parameters, in lengths of the directions; infinite for misses.
    object, face, patch : int32 of shape (...)
        Indices: of the object in the scene, of the input face, of the patch within the object; -1 for misses.
    st : array of shape (..., 2)
        Parameters in the patch's unit square; NaN for misses, as all that follows.
    uv : array of shape (..., 2)
        Texture coordinates or a surface's own parameters; NaN where there are none.
    rest, position : array of shape (..., 3)
        The hit's place on the undeformed object, and on the deformed one.
    normal : array of shape (..., 3)
        Unit geometric normal on the side of the face's winding.
    dp_ds, dp_dt : array of shape (..., 3)
        Partials of the position.
    """

    t: Floats
    object: NDArray[np.int32]
    face: NDArray[np.int32]
    patch: NDArray[np.int32]
    st: Floats
    uv: Floats
    rest: Floats
    position: Floats
    normal: Floats
    dp_ds: Floats
    dp_dt: Floats

    def __init__(
        self, arrays: dict[str, NDArray[Any]], shape: tuple[int, ...], objects: Sequence[Object | SceneObject]
    ) -> None:
        self._names = [*arrays]
        self._objects = objects
        for name, array in arrays.items():
            setattr(self, name, array.reshape(shape + array.shape[1:]))

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which rays hit, of shape (...)."""
        return self.object >= 0

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the arrays as `trimray trace` does (.npz)."""
        np.savez(path, **{name: getattr(self, name) for name in self._names})

    def __repr__(self) -> str:
        return f"{type(self).__name__}({np.count_nonzero(self.valid)} of {self.t.size})"


class AllHits(Hits):
    """Every hit of rays in one run, sorted along each ray: as `Hits`, whose leading shape is the number of hits.

    Attributes
    ----------
    offsets : int64 of shape (N + 1,)
        Where each ray's hits begin, with the number of all at the end.
    """

    offsets: NDArray[np.int64]

    def __init__(self, arrays: dict[str, NDArray[Any]], objects: Sequence[Object | SceneObject]) -> None:
        offsets = arrays.pop("offsets")
        super().__init__(arrays, (len(arrays["t"]),), objects)
        self.offsets = offsets
        self._names.append("offsets")


class Parts:
    """The text of a scene, with what of it is in memory."""

    def __init__(
        self,
        objects: Sequence[Object],
        camera: Camera | None = None,
        lights: Sequence[Light] | None = None,
        film: Mapping[str, Any] | None = None,
        render: Mapping[str, Any] | None = None,
        folder: str | None = None,
        names: Callable[[str], str] | None = None,
    ) -> None:
        self.meshes: list[tuple[int, Mesh]] = []
        self.lattices: list[tuple[int, int, Floats]] = []
        self._folder = folder
        # where the scene names a file for what is in memory
        self._file = names or (lambda name: name)
        self._names = {id(item): item.name or f"object {number}" for number, item in enumerate(objects, 1)}
        view = None if camera is None else camera.parameters
        tables = {"[camera]": view, "[film]": film, "[render]": render}
        blocks = ["light = []\n"] if lights is not None and not len(lights) else []
        blocks += [self._headed(header, table) for header, table in tables.items() if table is not None]
        materials = [material for item in objects for material in [item.material, *(item.materials or {}).values()]]
        self._materials: dict[int, str] = {}
        for material in materials:
            if material is not None and id(material) not in self._materials:
                name = f"material {len(self._materials) + 1}"
                self._materials[id(material)] = name
                blocks.append(self._headed("[[material]]", {"name": name, **material.parameters}))
        blocks += [self._headed("[[light]]", light.parameters) for light in lights or ()]
        for number, item in enumerate(objects):
            blocks += self._object(number, item)
        self.text = "\n".join(blocks)

    def _headed(self, header: str, table: Mapping[str, Any]) -> str:
        return headed(header, table, self._folder, self._names)

    def _object(self, number: int, item: Object) -> list[str]:
        name = self._names[id(item)]
        shape: dict[str, Any] = {}
        if isinstance(item.shape, FilePath):
            shape["mesh"] = item.shape
        elif isinstance(item.shape, Mesh):
            own = self._folder is not None and item.shape._path is not None
            shape["mesh"] = FilePath(item.shape._path) if own else self._file(f"{number + 1}.obj")
            self.meshes += [] if own else [(number, item.shape)]
        else:
            shape["surface"] = item.shape
        material = None if item.material is None else self._materials[id(item.material)]
        by_name = {key: self._materials[id(value)] for key, value in (item.materials or {}).items()} or None
        table = {"name": name, **shape, "material": material, "materials": by_name, **item.settings}
        blocks = [self._headed("[[object]]", table)]
        for index, deform in enumerate(item.deform):
            if not isinstance(deform, Lattice):
                blocks.append(self._headed("[[object.deform]]", deform.parameters))
                continue
            blocks.append(self._headed("[[object.deform]]", deform._settings))
            edits = deform._edits
            if deform._native is not None:
                edits = [{"control_points": self._file(f"{number + 1}_{index + 1}.npy")}]
                self.lattices.append((number, index, deform._native.numbers))
            blocks += [self._headed("[[object.deform.edit]]", edit) for edit in edits]
        return blocks

    def state(self) -> tuple[Any, ...]:
        """What decides the scene besides its text."""
        return (
            [(number, id(mesh)) for number, mesh in self.meshes],
            [lattice.tobytes() for _, _, lattice in self.lattices],
        )

    def build(self, method: str | None, least_squares: bool) -> _Scene:
        meshes = [(number, mesh._native) for number, mesh in self.meshes]
        return _told(_Scene(self.text, meshes, self.lattices, method, least_squares))


def _told(scene: _Scene) -> _Scene:
    for line in scene.warnings():
        warnings.warn(line, SceneWarning, stacklevel=4)
    return scene


def export_flags(path: str | os.PathLike[str], flags: Mapping[str, Any]) -> list[str]:
    """Keywords as flags of `trimray export`."""
    return ["-o", os.fspath(path), *command_flags(flags)]


def command_flags(flags: Mapping[str, Any]) -> list[str]:
    """Keywords as flags of a command: true ones alone, those of a list once for each element."""
    words: list[str] = []
    for key, value in flags.items():
        values = value if isinstance(value, (list, tuple)) else [value]
        for one in values:
            if one is not None and one is not False:
                words.append(f"--{key.replace('_', '-')}" + ("" if one is True else f"={one}"))
    return words


class Scene:
    """Objects, a camera and lights, built to be traced: it stays as it is if what it was made of changes.

    Several threads may use it at once.

    Parameters
    ----------
    objects : sequence of Object
    camera : Camera, optional
        Default: one that frames all objects.
    lights : sequence of Light, optional
        Default: a soft light from the camera's upper left over a dim sky; none at all if the sequence is empty.
    film : dict, optional
        `size`, `filter`, `crop`, as scene files have them.
    render : dict, optional
        `integrator`, `spp`, `max_depth`, `rr_depth`, `seed`, `aovs`, `hide_emitters`, as scene files have them.
    method : str, optional
        How all objects are represented, in place of what each says.
    least_squares : bool
        Whether drags that contradict each other are met as nearly as possible.

    Raises
    ------
    SceneError
        With all faults, one a line.
    """

    def __init__(
        self,
        objects: Object | Sequence[Object],
        camera: Camera | None = None,
        lights: Sequence[Light] | None = None,
        *,
        film: Mapping[str, Any] | None = None,
        render: Mapping[str, Any] | None = None,
        method: str | None = None,
        least_squares: bool = False,
    ) -> None:
        items = list(objects) if isinstance(objects, Sequence) else [objects]
        self._path: str | None = None
        # saved as it is now, whatever becomes of what it is made of
        self._made_of = (items, camera, lights, film, render)
        parts = Parts(*self._made_of)
        self._numbers = [numbers.copy() for _, _, numbers in parts.lattices]
        self._objects: Sequence[Object | SceneObject] = items
        self._native = parts.build(method, least_squares)

    @classmethod
    def _load(cls, path: str | os.PathLike[str], method: str | None, least_squares: bool) -> Scene:
        scene = cls.__new__(cls)
        scene._path = os.path.abspath(path)
        scene._native = _told(_Scene.load(os.fspath(path), method, least_squares))
        scene._objects = scene.objects
        return scene

    @property
    def objects(self) -> list[SceneObject]:
        """The objects, as the scene has them."""
        from ._object import SceneObject

        return [SceneObject(self._native, index, name) for index, name in enumerate(self._native.names())]

    @property
    def bounds(self) -> Floats:
        """Least and greatest corner of a box around all objects, of shape (2, 3)."""
        boxes = np.array([self._native.object_bounds(index) for index in range(len(self._native.names()))])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def __repr__(self) -> str:
        return f"Scene({', '.join(map(repr, self._native.names()))})"

    def trace(self, origins: Any, directions: Any) -> Hits:
        """The nearest hit of each ray.

        Parameters
        ----------
        origins, directions : array_like of shape (..., 3)
            Of shapes that go together, as NumPy broadcasts them. Directions of any length, in which `t` counts.

        Returns
        -------
        Hits

        Raises
        ------
        TypeError, ValueError
            Naming the argument, and the row of a ray that is not finite or has no direction.
        """
        starts, ways, shape = rays(origins, directions)
        return Hits(self._native.trace(starts, ways), shape, self._objects)

    def occluded(self, origins: Any, directions: Any) -> NDArray[np.bool_]:
        """Whether each ray hits anything, of shape (...); arguments as of `trace`."""
        starts, ways, shape = rays(origins, directions)
        return self._native.occluded(starts, ways).reshape(shape)

    def trace_all(self, origins: Any, directions: Any, *, once: bool = False) -> AllHits:
        """Every hit of each ray, sorted along it, in one run; `offsets` tells where each ray's begin.

        Parameters
        ----------
        origins, directions : array_like of shape (..., 3)
            As of `trace`; the rays count in C order.
        once : bool
            Whether an edge or a vertex that faces share counts once, not for each patch that has it.
        """
        starts, ways, _ = rays(origins, directions)
        return AllHits(self._native.trace_all(starts, ways, once), self._objects)

    def render(
        self,
        *,
        size: tuple[int, int] | None = None,
        crop: tuple[int, int, int, int] | None = None,
        spp: int | None = None,
        max_depth: int | None = None,
        seed: int | None = None,
        integrator: str | None = None,
        aovs: Sequence[str] | None = None,
        threads: int = 0,
        time_limit: float | None = None,
        progress: bool | Callable[[int, int], object] = False,
    ) -> Picture:
        """Renders the scene. Ctrl-C ends it.

        Parameters
        ----------
        size, crop, spp, max_depth, seed, integrator, aovs : optional
            In place of what the scene says, as the flags of `trimray render`.
        threads : int
            0 is one for each processor.
        time_limit : float, optional
            Seconds after which the picture has the samples that there are.
        progress : bool or callable
            Whether to show on stderr how far it is, or what to call with the numbers of samples done and of all.

        Returns
        -------
        Picture
            Of shape (height, width, 4), float32: linear R, G, B, and A.
        """
        settings = {
            "size": size,
            "crop": crop,
            "spp": spp,
            "max_depth": max_depth,
            "seed": seed,
            "integrator": integrator,
            "aovs": None if aovs is None else list(aovs),
            "threads": threads,
            "time_limit": time_limit,
        }
        call = _Progress() if progress is True else progress or None
        return Picture._of(_Picture(self._native, settings, call))

    def info(self) -> dict[str, Any]:
        """What `trimray info --json` tells."""
        found: dict[str, Any] = json.loads(self._native.info())
        return found

    def drags(self) -> dict[str, Any]:
        """What `trimray drags --json` tells."""
        found: dict[str, Any] = json.loads(self._native.drags())
        return found

    def export(self, path: str | os.PathLike[str], **flags: Any) -> None:
        """Writes all objects for other programs, as `trimray export` does; keywords are its flags."""
        self._native.export(export_flags(path, flags))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene as a scene file; meshes and lattices that are in no file go into a folder beside it.

        A scene that was loaded is saved beside its own file, whose paths it has.
        """
        folder, name = os.path.split(os.path.abspath(path))
        if self._path is not None:
            if folder != os.path.dirname(self._path):
                raise InputError(f"{path}: a scene that was loaded is saved in its own folder, {os.path.dirname(self._path)}")
            if os.path.realpath(path) != os.path.realpath(self._path):
                shutil.copyfile(self._path, path)
            return
        beside = f"{os.path.splitext(name)[0]}_files"
        parts = Parts(*self._made_of, folder, lambda file: f"{beside}/{file}")
        if parts.meshes or parts.lattices:
            os.makedirs(os.path.join(folder, beside), exist_ok=True)
        for number, mesh in parts.meshes:
            mesh._write_obj(os.path.join(folder, beside, f"{number + 1}.obj"))
        for (number, index, _), numbers in zip(parts.lattices, self._numbers):
            np.save(os.path.join(folder, beside, f"{number + 1}_{index + 1}.npy"), numbers)
        with open(path, "w", encoding="utf-8") as file:
            file.write(parts.text)


def load(path: str | os.PathLike[str], *, method: str | None = None, least_squares: bool = False) -> Scene:
    """Reads and builds a scene file.

    Parameters
    ----------
    path : path
    method, least_squares : optional
        As of `Scene`.

    Raises
    ------
    SceneError
        With all faults, each with file, line and column.
    """
    return Scene._load(path, method, least_squares)


class _Progress:
    """Tells on stderr how far work is."""

    def __init__(self) -> None:
        self._started = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        if not total:
            return
        seconds = time.monotonic() - self._started
        left = seconds * (total - done) / done if done else float("inf")
        end = "\n" if done == total else ""
        print(f"\r{100 * done // total:3d} %, {seconds:.1f} s, {left:.1f} s left ", end=end, file=sys.stderr, flush=True)
