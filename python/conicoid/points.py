"""Points from what holds them: arrays, files, other packages' clouds, ROS messages."""

from __future__ import annotations

import os
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._native import Cloud as NativeCloud
from ._native import from_array
from ._native import read as native_read
from .parameters import given

__all__ = ["Cloud", "as_points", "from_pointcloud2", "read"]

FloatArray = npt.NDArray[np.float64]
PathOrBytes = Union[str, "os.PathLike[str]", bytes]


class Cloud:
    """A point cloud that was read from a file."""

    def __init__(self, native: NativeCloud) -> None:
        self._native = native
        self._points: FloatArray | None = None

    @property
    def points(self) -> FloatArray:
        """The points in the file's order, float64 (n, 3), in the file's unit; NaN where one is no number."""
        if self._points is None:
            self._points = self._native.array()
            self._points.flags.writeable = False
        return self._points

    @property
    def fields(self) -> dict[str, npt.NDArray[Any]]:
        """The file's own columns beside x, y and z (normals, colours, intensity), by their names: of PLY files."""
        columns, records = self._native.fields()
        if not columns:
            return {}
        table = np.frombuffer(records, dtype=[(name, _PLY_TYPES[kind]) for name, kind in columns])
        return {name: table[name] for name, _ in columns}

    @property
    def format(self) -> str:
        """The name of the format it was read as."""
        return self._native.format or ""

    @property
    def sha256(self) -> str:
        """SHA-256 of the file's bytes, in hexadecimal."""
        return self._native.sha256 or ""

    @property
    def grid(self) -> tuple[int, int] | None:
        """Points in a row and number of rows, where the file is organised."""
        return self._native.grid

    def __len__(self) -> int:
        return len(self._native)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        is_other = dtype is not None and np.dtype(dtype) != self.points.dtype
        return self.points.astype(dtype or np.float64) if copy or is_other else self.points

    def __repr__(self) -> str:
        return f"<Cloud of {len(self)} points, {self.format}>"


_PLY_TYPES = {
    "char": "<i1",
    "uchar": "<u1",
    "short": "<i2",
    "ushort": "<u2",
    "int": "<i4",
    "uint": "<u4",
    "float": "<f4",
    "double": "<f8",
}


def read(source: PathOrBytes, **options: Any) -> Cloud:
    """Reads a point cloud as the service does: PLY, PCD, LAS, LAZ, E57, PTX, STL, OBJ, OFF, text.

    Parameters
    ----------
    source
        The path of a file, or the bytes of one.
    options
        What tells how it is read: ``format``, ``columns`` and what else `parameters` lists.

    Raises
    ------
    OSError
        The file cannot be opened.
    CloudError
        It is no cloud of that format, or holds no finite point.
    """
    threads = options.pop("threads", None)
    if isinstance(source, (bytes, bytearray, memoryview)):
        return Cloud(native_read(None, bytes(source), given(options), threads))
    return Cloud(native_read(os.fspath(source), None, given(options), threads))


def as_points(points: Any) -> npt.NDArray[Any]:
    """The points as an array (n, 3) of float64 or float32, without a copy where it is one already.

    Takes what NumPy makes an array of (lists, data frames, masked arrays, whose masked points are holes), and clouds with
    an attribute ``points`` (Open3D, PyVista) or ``vertices`` (trimesh).
    """
    for name in ("points", "vertices"):
        if not isinstance(points, np.ndarray) and hasattr(points, name):
            points = getattr(points, name)
            break
    if isinstance(points, np.ma.MaskedArray):
        points = np.ma.filled(points.astype(np.float64), np.nan)
    array = np.asarray(points)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"points must be numbers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must have the shape (n, 3), not {array.shape}{_cure(array)}")
    is_taken = array.dtype in (np.float64, np.float32) and array.dtype.isnative
    return array if is_taken and array.flags.aligned else array.astype(np.float64)


def _cure(array: npt.NDArray[Any]) -> str:
    if array.ndim == 2 and array.shape[0] == 3:
        return ": pass points.T"
    if array.ndim == 2 and array.shape[1] > 3:
        return ": pass points[:, :3] where x, y and z come first"
    if array.ndim > 2 and array.shape[-1] == 3:
        return ": pass points.reshape(-1, 3)"
    return ""


def native(points: Any) -> NativeCloud:
    """The points as the native half takes them."""
    if isinstance(points, Cloud):
        return points._native
    array = as_points(points)
    return from_array(array)


#: The NumPy types of sensor_msgs/PointField, by its numbers.
_FIELD_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def from_pointcloud2(message: Any) -> npt.NDArray[Any]:
    """The points of a ROS ``sensor_msgs/PointCloud2`` message (ROS 1 or 2), (n, 3), row by row.

    It needs no ROS: `message` is anything with the attributes ``fields`` (each with ``name``, ``offset``, ``datatype``
    and ``count``), ``width``, ``height``, ``point_step``, ``row_step``, ``is_bigendian`` and ``data``. Points that are
    NaN or infinite stay in their places, and are unassigned in every answer. Coordinates of float32 are float32.

    Raises
    ------
    ValueError
        A coordinate is missing or no number, or ``data`` is shorter than the message says.
    """
    order = ">" if message.is_bigendian else "<"
    fields = {field.name: field for field in message.fields}
    columns: list[tuple[int, np.dtype[Any]]] = []
    for name in ("x", "y", "z"):
        if name not in fields:
            raise ValueError(f"the message has no field '{name}'; it has {', '.join(fields)}")
        code = _FIELD_TYPES.get(int(fields[name].datatype))
        if code is None:
            raise ValueError(f"the datatype {fields[name].datatype} of '{name}' is none of 1 to 8")
        columns.append((int(fields[name].offset), np.dtype(order + code)))
    height, width = int(message.height), int(message.width)
    step, row = int(message.point_step), int(message.row_step)
    end = max(offset + kind.itemsize for offset, kind in columns)
    data = np.frombuffer(message.data, dtype=np.uint8)
    needed = (height - 1) * row + (width - 1) * step + end if height and width else 0
    if data.size < needed:
        raise ValueError(f"the message has {data.size} bytes of data; its points need {needed}")
    if end > step or (height > 1 and row < width * step):
        raise ValueError(f"point_step {step} and row_step {row} are too short for its points")
    is_single = all(kind.kind == "f" and kind.itemsize == 4 for _, kind in columns)
    points = np.empty((height, width, 3), np.float32 if is_single else np.float64)
    for k, (offset, kind) in enumerate(columns):
        if points.size:
            points[..., k] = np.ndarray((height, width), kind, data.data, offset, (row, step))
    return points.reshape(-1, 3)
