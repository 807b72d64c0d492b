"""Clouds as bodies of requests."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .parameters import given
from .points import Cloud, as_points

__all__ = ["Body", "body_of", "named"]

#: Points sent at once.
_BLOCK = 1 << 16


def named(points: Any, parameters: Mapping[str, Any]) -> dict[str, str]:
    """The parameters as text, with the name of a file."""
    options = dict(given(parameters))
    if isinstance(points, (str, os.PathLike)) and "name" not in options:
        options["name"] = Path(points).name
    return options


class Body:
    """A body that can be sent more than once, in pieces."""

    def __init__(self, length: int, chunks: Callable[[], Iterator[bytes]]) -> None:
        self.length = length
        self.chunks = chunks


def body_of(points: Any) -> tuple[Body, str, Any]:
    """The body for a cloud, its media type, and what gives the points again."""
    if isinstance(points, (str, os.PathLike)):
        path = Path(points)
        # what keeps it from being read is told before anything is sent
        with path.open("rb"):
            pass
        return Body(path.stat().st_size, lambda: _pieces(path)), _type_of(path), points
    array = points.points if isinstance(points, Cloud) else as_points(points)
    kind = "float" if array.dtype == np.float32 else "double"
    names = "".join(f"property {kind} {name}\n" for name in "xyz")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(array)}\n{names}end_header\n"

    def chunks() -> Iterator[bytes]:
        yield head.encode()
        for first in range(0, len(array), _BLOCK):
            block = np.ascontiguousarray(array[first : first + _BLOCK])
            yield block.astype(block.dtype.newbyteorder("<"), copy=False).tobytes()

    return Body(len(head) + array.size * array.itemsize, chunks), "model/ply", array


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(1 << 20):
            yield piece


#: Endings that the service tells by a media type; others it tells from the bytes.
_TYPES_OF_FILES = {
    ".ply": "model/ply",
    ".pcd": "model/pcd",
    ".las": "application/vnd.las",
    ".laz": "application/vnd.laszip",
    ".e57": "model/e57",
    ".stl": "model/stl",
    ".obj": "model/obj",
}


def _type_of(path: Path) -> str:
    return _TYPES_OF_FILES.get(path.suffix.lower(), "application/octet-stream")
