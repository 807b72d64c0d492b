"""Files and ROS messages as points."""

from __future__ import annotations

import hashlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import FloatArray

import conicoid


def test_a_file_gives_its_points_and_its_own_columns(part: FloatArray, part_file: Path) -> None:
    cloud = conicoid.read(part_file)
    assert np.array_equal(cloud.points, part) and len(cloud) == len(part)
    assert list(cloud.fields) == ["intensity"] and cloud.fields["intensity"].dtype == np.uint16
    assert np.array_equal(cloud.fields["intensity"], np.arange(len(part)))
    assert cloud.format == "ply" and cloud.grid is None and "15000 points, ply" in repr(cloud)
    assert cloud.sha256 == hashlib.sha256(part_file.read_bytes()).hexdigest()
    again = conicoid.read(part_file.read_bytes())
    assert np.array_equal(again.points, part) and again.sha256 == cloud.sha256
    assert np.array_equal(np.asarray(cloud, dtype=np.float32), part.astype(np.float32))


def test_every_column_of_a_ply_file_has_its_type() -> None:
    columns = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double"]
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    head += "".join(f"property float {name}\n" for name in "xyz")
    head += "".join(f"property {kind} a_{kind}\n" for kind in columns) + "end_header\n"
    rows = "1 2 3 -1 255 -2 65535 -3 4294967295 0.5 1e300\n4 5 6 7 7 7 7 7 7 7 7\n"
    fields = conicoid.read((head + rows).encode()).fields
    values = [fields[f"a_{kind}"][0].item() for kind in columns]
    assert values == [-1, 255, -2, 65535, -3, 4294967295, 0.5, 1e300]
    kinds = [fields[f"a_{kind}"].dtype.str for kind in columns]
    assert kinds == ["|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<f4", "<f8"]


def test_holes_keep_their_places(tmp_path: Path) -> None:
    path = tmp_path / "grid.pcd"
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 2\n"
    path.write_text(head + "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n1 2 3\nnan nan nan\n4 5 6\n7 8 9\n")
    cloud = conicoid.read(path)
    nan = np.nan
    expected = [[1, 2, 3], [nan, nan, nan], [4, 5, 6], [7, 8, 9]]
    assert np.array_equal(cloud.points, expected, equal_nan=True) and cloud.grid == (2, 2)


def test_options_tell_how_a_text_is_read() -> None:
    text = b"1 10 20 30\n2 40 50 60\n3 70 80 95\n"
    cloud = conicoid.read(text, format="xyz", columns=[2, 3, 4])
    assert np.array_equal(cloud.points, [[10, 20, 30], [40, 50, 60], [70, 80, 95]])
    assert cloud.fields == {}


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        conicoid.read(tmp_path / "none.ply")
    with pytest.raises(conicoid.CloudError) as error:
        conicoid.read(b"hello")
    assert error.value.code == "unknown_format" and error.value.status is None
    with pytest.raises(conicoid.UnknownParameterError, match="known ones"):
        conicoid.read(b"1 2 3\n", colums=[1, 2, 3])


def message(points: FloatArray, kind: str, *, big: bool = False, height: int = 1) -> Any:
    """A PointCloud2 of `height` rows with a leading intensity and bytes that mean nothing."""
    datatype = {"f4": 7, "f8": 8, "i2": 3}[kind]
    order, size = ">" if big else "<", np.dtype(kind).itemsize
    names = ("y", "x", "z")
    step = 2 + 3 * size + 5
    width = len(points) // height
    row = width * step + 7
    data = np.random.default_rng(0).integers(0, 256, height * row).astype(np.uint8)
    for k, point in enumerate(points):
        at = k // width * row + k % width * step + 2
        values = [point["xyz".index(name)] for name in names]
        data[at : at + 3 * size] = np.frombuffer(np.array(values, order + kind).tobytes(), np.uint8)
    fields = [SimpleNamespace(name="intensity", offset=0, datatype=4, count=1)]
    fields += [
        SimpleNamespace(name=name, offset=2 + k * size, datatype=datatype, count=1)
        for k, name in enumerate(names)
    ]
    return SimpleNamespace(
        fields=fields,
        width=width,
        height=height,
        point_step=step,
        row_step=row,
        is_bigendian=big,
        data=data.tobytes(),
    )


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("height", [1, 5])
@pytest.mark.parametrize("kind", ["f4", "f8", "i2"])
def test_a_ros_message_is_read_byte_by_byte(kind: str, height: int, big: bool) -> None:
    points = np.random.default_rng(1).integers(-500, 500, (30, 3)).astype(np.float64)
    if kind != "i2":
        points /= 8
        points[7] = np.nan
    made = conicoid.from_pointcloud2(message(points, kind, big=big, height=height))
    assert np.array_equal(made, points, equal_nan=True)
    assert made.dtype == (np.float32 if kind == "f4" else np.float64) and made.dtype.isnative


def test_a_ros_message_is_segmented(part: FloatArray, found: conicoid.Segmentation) -> None:
    points = conicoid.from_pointcloud2(message(part, "f8", height=3))
    assert np.array_equal(conicoid.segment(points).labels, found.labels)
    # ROS 1 gives bytes, ROS 2 an array
    other = message(part, "f8")
    other.data = np.frombuffer(other.data, np.uint8)
    assert np.array_equal(conicoid.from_pointcloud2(other), part)


def test_a_ros_message_that_is_wrong_is_refused() -> None:
    points = np.ones((6, 3))
    short = message(points, "f4", height=2)
    short.data = short.data[:-13]
    with pytest.raises(ValueError, match="bytes of data; its points need"):
        conicoid.from_pointcloud2(short)
    whole = message(points, "f4", height=2)
    # behind the last coordinate there may be less than a whole row
    whole.data = whole.data[:-12]
    assert np.array_equal(conicoid.from_pointcloud2(whole), points)
    unnamed = message(points, "f4")
    unnamed.fields.pop()
    with pytest.raises(ValueError, match="no field 'z'; it has intensity, y, x"):
        conicoid.from_pointcloud2(unnamed)
    odd = message(points, "f4")
    odd.fields[1].datatype = 9
    with pytest.raises(ValueError, match="datatype 9 of 'y'"):
        conicoid.from_pointcloud2(odd)
    narrow = message(points, "f4", height=2)
    narrow.point_step = 8
    with pytest.raises(ValueError, match="too short"):
        conicoid.from_pointcloud2(narrow)
    empty = message(points, "f4")
    empty.width = 0
    assert conicoid.from_pointcloud2(empty).shape == (0, 3)
