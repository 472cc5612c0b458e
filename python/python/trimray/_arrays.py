"""Arguments as arrays of float64, and what is wrong with those that are not."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def numbers(name: str, value: Any, columns: int) -> Floats:
    """`value` as float64 of shape (..., columns), without a copy where it is that already."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if array.dtype.kind not in "biufO":
        raise TypeError(f"{name}: holds {array.dtype}, numbers that float64 can hold are needed")
    try:
        array = np.require(array, np.float64, "A")
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name}: {error}") from None
    if array.ndim == 0 or array.shape[-1] != columns:
        raise ValueError(f"{name}: has the shape {array.shape}, (..., {columns}) is needed")
    return array


def rows(name: str, value: Any, columns: int) -> tuple[Floats, tuple[int, ...]]:
    """`value` as float64 of shape (N, columns), and its own leading shape."""
    array = numbers(name, value, columns)
    return array.reshape(-1, columns), array.shape[:-1]


def rays(origins: Any, directions: Any) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Rays as two arrays of shape (N, 3), and the leading shape that the two have together."""
    starts, ways = numbers("origins", origins, 3), numbers("directions", directions, 3)
    try:
        shape = np.broadcast_shapes(starts.shape, ways.shape)
    except ValueError:
        message = f"origins: of shape {starts.shape}, which does not go with directions of shape {ways.shape}"
        raise ValueError(message) from None
    starts, ways = np.broadcast_to(starts, shape), np.broadcast_to(ways, shape)
    return starts.reshape(-1, 3), ways.reshape(-1, 3), shape[:-1]


def integers(name: str, value: Any) -> NDArray[np.int64]:
    """`value` as int64."""
    array = np.asarray(value)
    if array.size == 0:
        return array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name}: holds {array.dtype}, integers are needed")
    return np.require(array, np.int64, "A")
