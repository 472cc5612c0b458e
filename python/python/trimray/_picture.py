"""Pictures and how they differ."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _trimray

#: layers of whole numbers
_IDS = ("object", "face", "patch")


class Picture(np.ndarray):
    """A rendered picture: a read-only array of shape (height, width, 4), float32: linear R, G, B, and A.

    Attributes
    ----------
    layers : dict
        What `aovs` asked for, by name: arrays of shape (height, width) or (height, width, components); ids are int32.
    samples : (int, int)
        The least and the greatest number of samples of a pixel.
    """

    _native: _trimray.Picture | None
    layers: dict[str, NDArray[Any]]
    samples: tuple[int, int]

    @classmethod
    def _of(cls, native: _trimray.Picture) -> Picture:
        channels = native.channels()
        colours = [array for name, array in channels if "." not in name]
        picture = np.stack(colours, axis=-1).view(cls)
        grouped: dict[str, list[NDArray[np.float32]]] = {}
        for name, array in channels:
            if "." in name:
                grouped.setdefault(name.rsplit(".", 1)[0], []).append(array)
        picture._native = native
        least, most = native.samples
        picture.samples = (least, most)
        picture.layers = {name: _layer(name, arrays) for name, arrays in grouped.items()}
        for array in (picture, *picture.layers.values()):
            array.flags.writeable = False
        return picture

    def __array_finalize__(self, other: Any) -> None:
        # what is made of a picture is no picture that was rendered
        self._native = None
        self.layers = {}
        self.samples = (0, 0)

    def __repr__(self) -> str:
        if self._native is None:
            return super().__repr__()
        height, width, _ = self.shape
        return f"Picture({width} x {height}, {self.samples[1]} samples, layers {[*self.layers]})"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes what `trimray render` writes: .exr with all layers, or .png, a tone-mapped preview.

        Raises
        ------
        OutputError, InputError
        ValueError
            If this is an array that was made of a picture.
        """
        if self._native is None:
            raise ValueError("only a picture as it was rendered can be saved")
        self._native.save(os.fspath(path))

    def _repr_png_(self) -> bytes | None:
        return None if self._native is None else self._native.png()


def _layer(name: str, arrays: list[NDArray[np.float32]]) -> NDArray[Any]:
    layer: NDArray[Any] = arrays[0] if len(arrays) == 1 else np.stack(arrays, axis=-1)
    return layer.astype(np.int32) if name in _IDS else layer


class Difference:
    """How far a picture is from a reference.

    Attributes
    ----------
    status : {"pass", "warn", "fail"}
    mean_error, rms_error, psnr : float
    max_error : dict
        `value`, and where: `x`, `y`, `channel`, `reference`, `test`.
    failing, warning : int
        Pixels over the thresholds.
    metrics : dict
        The mean of each metric asked for.
    maps : dict
        The error of each pixel, of shape (height, width): of each metric that has one, and "absolute".
    figures : dict
        All that `trimray diff --json` prints.
    """

    def __init__(self, text: str, maps: dict[str, NDArray[np.float32]]) -> None:
        figures: dict[str, Any] = json.loads(text)
        self.figures = figures
        self.maps = maps
        self.status: str = figures["status"]
        self.mean_error: float = figures["mean_error"]
        self.rms_error: float = figures["rms_error"]
        self.psnr: float = math.inf if figures["psnr"] is None else figures["psnr"]
        self.max_error: dict[str, Any] = figures["max_error"]
        self.failing: int = figures["failing"]
        self.warning: int = figures["warning"]
        means = {metric["name"]: metric["mean"] for metric in figures["metrics"]}
        self.metrics: dict[str, float] = {name: math.inf if mean is None else mean for name, mean in means.items()}

    def __repr__(self) -> str:
        means = "".join(f", {name} {mean:.6g}" for name, mean in self.metrics.items())
        return f"Difference({self.status}, {self.failing} pixels fail, mean error {self.mean_error:.6g}{means})"


def diff(
    reference: Any,
    test: Any,
    *,
    metric: str | list[str] | None = None,
    layer: Mapping[str, str] | None = None,
    **flags: Any,
) -> Difference:
    """Compares a picture with a reference, as `trimray diff` does.

    Parameters
    ----------
    reference, test : path, Picture or array_like of shape (height, width), (height, width, 3) or (height, width, 4)
        Arrays hold linear colours.
    metric : str or list of str, optional
        "mae", "mse", "rmse", "relmse", "psnr", "ssim", "flip", "hdrflip" or "ulp".
    layer : dict, optional
        Thresholds of layers, such as {"depth": "fail=1e-4"}.
    **flags
        The command's, without hyphens: `fail=0.004`, `ztest=True`, `heatmap="x.png"`, …

    Returns
    -------
    Difference

    Raises
    ------
    InputError
        If a file cannot be read, or if the pictures have other sizes or channels.
    """
    from ._scene import command_flags

    words = command_flags({"metric": metric, **flags})
    for name, settings in (layer or {}).items():
        words += ["--layer", name, settings]
    pairs = {"reference": reference, "test": test}
    names = [os.fspath(one) if isinstance(one, (str, os.PathLike)) else name for name, one in pairs.items()]
    compared = [_compared(name, one) for name, one in pairs.items()]
    return Difference(*_trimray.diff(compared[0], compared[1], (names[0], names[1]), words))


def _compared(name: str, picture: Any) -> Any:
    if isinstance(picture, (str, os.PathLike)):
        return os.fspath(picture)
    if isinstance(picture, Picture) and picture._native is not None:
        return picture._native
    array = np.asarray(picture)
    if array.dtype.kind != "f":
        raise TypeError(f"{name}: holds {array.dtype}, linear colours of floating point are needed")
    array = array[..., None] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[2] not in (1, 3, 4):
        raise ValueError(f"{name}: has the shape {np.shape(picture)}, (height, width) and 3 or 4 channels are needed")
    return np.require(array, np.float32, "A")
