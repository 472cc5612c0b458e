"""Values as the text of a scene file (TOML)."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np


class FilePath(str):
    """A path, from the current folder; in a scene file from that file's."""


class Table:
    """A table of a scene file: a material, a light, a camera, a surface, …

    Attributes
    ----------
    parameters : dict
        Names and values as scene files have them, without those that are left out.
    """

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters = {key: value for key, value in parameters.items() if value is not None}

    def __repr__(self) -> str:
        given = ", ".join(f"{key}={value!r}" for key, value in self.parameters.items() if key != "type")
        return f"{type(self).__name__}({given})"


def value_text(value: Any, folder: str | None = None, names: Mapping[int, str] | None = None) -> str:
    """A value in one line. Paths are from `folder`; `names` are those of objects, by their identities."""
    if names and id(value) in names:
        value = names[id(value)]
    if isinstance(value, Table):
        value = value.parameters
    if isinstance(value, os.PathLike):
        value = FilePath(os.fspath(value))
    if isinstance(value, FilePath) and folder is not None:
        value = os.path.relpath(value, folder)
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_entries(value, folder, names))} }}"
    if isinstance(value, Iterable):
        return f"[{', '.join(value_text(element, folder, names) for element in value)}]"
    raise TypeError(f"a scene cannot hold {value!r}")


def _entries(table: Mapping[str, Any], folder: str | None, names: Mapping[int, str] | None) -> list[str]:
    given = ((key, value) for key, value in table.items() if value is not None)
    return [f"{_key(key)} = {value_text(value, folder, names)}" for key, value in given]


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else value_text(str(key))


def headed(
    header: str, table: Mapping[str, Any], folder: str | None = None, names: Mapping[int, str] | None = None
) -> str:
    """A table under its header, one entry a line."""
    return "\n".join([header, *_entries(table, folder, names)]) + "\n"
