"""Meshes, whose faces are sampled."""

from __future__ import annotations

import copy
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import without_times

import conicoid

#: The corners of a block of 20 x 30 x 40, and its faces with outer corners counterclockwise.
CORNERS = [(x, y, z) for x in (0, 20) for y in (0, 30) for z in (0, 40)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The block as an OFF file."""
    path = tmp_path_factory.mktemp("meshes") / "block.off"
    rows = ["OFF", f"{len(CORNERS)} {len(FACES)} 0", *(" ".join(map(str, c)) for c in CORNERS)]
    rows += [f"4 {' '.join(map(str, face))}" for face in FACES]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_each_face_has_its_label(command: Path, block: Path, tmp_path: Path) -> None:
    result = conicoid.segment(block)
    assert [region.type for region in result.regions] == ["plane"] * 6
    assert result.input.mesh is not None and result.input.mesh.faces == 6
    assert len(result.labels) == len(result.points) == result.input.points
    assert result.face_labels is not None and result.face_labels.dtype == np.int32
    assert sorted(result.face_labels) == list(range(6))
    for label, face in zip(result.face_labels, FACES):
        own = np.array([CORNERS[k] for k in face], float)
        across = int(np.argmin(np.ptp(own, axis=0)))
        assert np.allclose(result.points_of(int(label))[:, across], own[0, across], atol=1e-9)
    output = tmp_path / "block.json"
    subprocess.run([command, "segment", block, "-o", output, "--quiet"], check=True)
    document = json.loads(output.read_bytes())
    assert without_times(result.to_dict()) == without_times(document)
    assert "face_labels" not in result.to_dict(labels=False)
    for again in [copy.deepcopy(result), conicoid.load(output, block)]:
        assert without_times(again.to_dict()) == without_times(document)


def test_the_service_labels_the_same_faces(service: str, block: Path) -> None:
    local, remote = conicoid.segment(block), conicoid.Client(service).segment(block)
    assert without_times(remote.to_dict()) == without_times(local.to_dict())


def test_the_vertices_may_be_the_points(block: Path) -> None:
    cloud = conicoid.read(block, mesh="vertices")
    assert np.array_equal(cloud.points, CORNERS) and cloud.format == "off"
    assert len(conicoid.read(block, mesh_spacing=1)) > 4000
    with pytest.raises(conicoid.ParameterError, match="the points are an array"):
        conicoid.segment(np.random.default_rng(0).uniform(size=(99, 3)), mesh="faces")
