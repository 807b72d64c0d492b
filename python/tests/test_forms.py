"""The answer as objects, text and files, and the same from the command line."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import FloatArray, without_times

import conicoid


@pytest.fixture(scope="module")
def of_file(part_file: Path) -> conicoid.Segmentation:
    return conicoid.segment(part_file)


def told(command: Path, cloud: Path, output: Path, *flags: str) -> bytes:
    subprocess.run([command, "segment", cloud, "-o", output, "--quiet", *flags], check=True)
    return output.read_bytes()


def test_the_command_line_says_the_same_to_the_last_bit(
    command: Path, part_file: Path, of_file: conicoid.Segmentation, tmp_path: Path
) -> None:
    document = json.loads(told(command, part_file, tmp_path / "part.json"))
    assert without_times(of_file.to_dict()) == without_times(document)
    assert without_times(json.loads(of_file.to_json())) == without_times(document)
    assert document["labels"] == of_file.labels.tolist()
    flags = ["--surfaces", "plane,cylinder", "--snap", "--min-points", "77"]
    document = json.loads(told(command, part_file, tmp_path / "part.json", *flags))
    again = conicoid.segment(part_file, surfaces="plane,cylinder", snap=True, min_points=77)
    assert without_times(again.to_dict()) == without_times(document)


def test_an_array_has_the_answer_of_the_file_it_came_from(
    part: FloatArray, found: conicoid.Segmentation, of_file: conicoid.Segmentation
) -> None:
    cloud = conicoid.segment(conicoid.read(of_file._source.write("ply", True)))
    names = ["regions", "relations", "measures", "unassigned", "parameters", "counters", "labels"]
    for other in (of_file.to_dict(), cloud.to_dict()):
        for name in names:
            assert found.to_dict()[name] == other[name], name


@pytest.mark.parametrize(
    "ending", ["ply", "csv", "points.csv", "npy", "deviations.npy", "step", "html", "png"]
)
def test_saved_files_are_those_of_the_command_line(
    command: Path, part_file: Path, of_file: conicoid.Segmentation, tmp_path: Path, ending: str
) -> None:
    expected = told(command, part_file, tmp_path / f"expected.{ending}")
    path = tmp_path / f"part.{ending.upper()}"
    of_file.save(path)
    assert path.read_bytes() == expected and len(expected) > 100


def test_json_is_saved_with_labels_or_without(found: conicoid.Segmentation, tmp_path: Path) -> None:
    found.save(tmp_path / "a.b.json")
    assert json.loads((tmp_path / "a.b.json").read_text()) == found.to_dict()
    found.save(str(tmp_path / "short.json"), labels=False)
    assert json.loads((tmp_path / "short.json").read_text()) == found.to_dict(labels=False)
    short = conicoid.segment(found.points, labels="none")
    assert "labels" not in short.to_dict() and np.array_equal(short.labels, found.labels)


def test_a_file_is_replaced_whole_and_an_unknown_ending_is_refused(
    found: conicoid.Segmentation, tmp_path: Path
) -> None:
    path = tmp_path / "part.csv"
    path.write_text("before")
    path.chmod(0o640)
    found.save(path)
    assert path.read_text().startswith("id,type") and path.stat().st_mode & 0o777 == 0o640
    for name in ["part.iges", "part", "json"]:
        with pytest.raises(conicoid.ParameterError, match=r"end it in \.json, \.step"):
            found.save(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        found.save(tmp_path / "none" / "part.json")
    assert [file.name for file in tmp_path.iterdir()] == ["part.csv"]


def test_fields_are_attributes_and_items(found: conicoid.Segmentation) -> None:
    region = found.regions[0]
    assert region.surface.to_dict() == region["surface"].to_dict() == found.to_dict()["regions"][0]["surface"]
    assert region.arc_angle is None and "arc_angle" not in region
    with pytest.raises(AttributeError, match="Region has no field 'radius'; it has arc_angle, area"):
        region.radius  # noqa: B018
    with pytest.raises(AttributeError, match="cannot be changed"):
        region.id = 7
    with pytest.raises(ValueError, match="read-only"):
        found.labels[0] = 7
    with pytest.raises(ValueError, match="read-only"):
        region.local_origin[0] = 7
    assert region.local_origin.dtype == np.float64 and region.local_origin.shape == (3,)
    assert region.uncertainty.covariance.ndim == 2
    assert "point_count=" in repr(region) and "surface" in dir(region)
    assert {**region.fit} == region.fit.to_dict()


def test_what_to_dict_gives_may_be_changed(found: conicoid.Segmentation) -> None:
    document = found.to_dict()
    document["regions"][0]["local_origin"][0] = 1e9
    document["regions"].clear()
    assert len(found.regions) == 3 and found.regions[0].local_origin[0] < 1e9


def test_a_summary_is_shown(found: conicoid.Segmentation) -> None:
    assert repr(found).startswith("<Segmentation of 15000 points: 3 regions (")
    assert found._repr_html_().count("<tr>") == 4


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_a_copy_can_all_that_the_answer_can(found: conicoid.Segmentation, copied: object) -> None:
    again = copied(found)  # type: ignore[operator]
    assert again.to_dict() == found.to_dict()
    assert np.array_equal(again.deviations, found.deviations, equal_nan=True)
    for ending in ("ply", "step", "csv"):
        assert again._source.write(ending, True) == found._source.write(ending, True)
    region = pickle.loads(pickle.dumps(found.regions[1]))
    assert region == found.regions[1] and type(region) is conicoid.Region


def test_a_saved_answer_is_loaded_with_its_points(
    part: FloatArray, found: conicoid.Segmentation, tmp_path: Path
) -> None:
    found.save(tmp_path / "part.json")
    again = conicoid.load(tmp_path / "part.json", part)
    assert again.to_dict() == found.to_dict()
    assert np.array_equal(again.deviations, found.deviations, equal_nan=True)
    with pytest.raises(conicoid.CloudError, match="about 15000 points, and there are 14999 points"):
        conicoid.load(tmp_path / "part.json", part[1:])
    found.save(tmp_path / "short.json", labels=False)
    with pytest.raises(ValueError, match="holds no labels"):
        conicoid.load(tmp_path / "short.json", part)
    (tmp_path / "other.json").write_text('{"labels": []}')
    with pytest.raises(conicoid.CloudError, match="no result of this version"):
        conicoid.load(tmp_path / "other.json", part)


def test_a_table_for_pandas(found: conicoid.Segmentation) -> None:
    pytest.importorskip("pandas")
    table = found.to_pandas()
    assert list(table.index) == [0, 1, 2] and list(table["type"]) == [r.type for r in found.regions]
    (tube,) = [region for region in found.regions if region.type == "cylinder"]
    assert table.loc[tube.id, "radius"] == tube.surface.radius
    assert table.loc[tube.id, "diameter_sd"] == tube.uncertainty.diameter


def test_a_picture_by_matplotlib(found: conicoid.Segmentation, tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = found.plot(most_points=3000, s=4)
    shown = sum(len(part.get_offsets()) for part in axes.collections)
    assert shown == 3000
    names = [part.get_label() for part in axes.collections]
    assert all(any(f"{r.id} {r.type}" == name for name in names) for r in found.regions)
    assert found.plot(axes) is axes
    axes.figure.savefig(tmp_path / "part.png")


def test_points_for_open3d(found: conicoid.Segmentation) -> None:
    pytest.importorskip("open3d")
    cloud = found.to_open3d()
    assert np.array_equal(np.asarray(cloud.points), found.points)
    assert np.allclose(np.asarray(cloud.colors) * 255, found.colors)
    pieces = found.to_open3d(split=True)
    assert [len(piece.points) for piece in pieces[:-1]] == [r.point_count for r in found.regions]
    assert np.array_equal(conicoid.segment(cloud).labels, found.labels)


def test_points_have_the_colours_of_the_other_forms(found: conicoid.Segmentation) -> None:
    fields = conicoid.read(found._source.write("ply", True)).fields
    columns = np.column_stack([fields[name] for name in ("red", "green", "blue")])
    assert np.array_equal(columns, found.colors)
    assert np.array_equal(fields["label"], found.labels)
