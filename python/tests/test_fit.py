"""Fits of single features."""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import FloatArray, cylinder, sphere

import conicoid

TURN = np.array([[0.8, -0.6, 0.0], [0.36, 0.48, -0.8], [0.48, 0.64, 0.6]])


@pytest.fixture(scope="module")
def bore() -> FloatArray:
    """A tube of radius 8 about the third row of `TURN` through (100, 200, 300)."""
    points: FloatArray = cylinder(2000, 8, 25, 0.01, 4) @ TURN + [100, 200, 300]
    return points


def test_a_feature_is_fitted_where_it_is(bore: FloatArray) -> None:
    result = conicoid.fit(bore, type="cylinder", residuals=True)
    assert result.type == "cylinder" and result.used == 2000 and result.rejected == []
    assert isinstance(result, conicoid.records.FitDocument)
    surface = result.surface
    assert surface.radius == pytest.approx(8, abs=5 * 0.01 / np.sqrt(2000))
    along = surface.axis_direction * np.sign(surface.axis_direction @ TURN[2])
    assert np.allclose(along, TURN[2], atol=2e-4)
    off = bore - surface.axis_point
    distance = np.linalg.norm(off - np.outer(off @ along, along), axis=1) - surface.radius
    assert np.allclose(result.residuals.values_, distance, atol=1e-9)
    assert result.residuals.rms == pytest.approx(np.sqrt(np.mean(distance**2)), rel=1e-9)
    assert result.input.sha256 == hashlib.sha256(bore.tobytes()).hexdigest()
    assert result.to_dict()["surface"] == surface.to_dict()


def test_the_zone_is_the_smallest() -> None:
    ball = sphere(300, 6, 0.01, 5)
    zone = conicoid.fit(ball, type="sphere", association="minimum_zone")
    gauss = conicoid.fit(ball, type="sphere")

    def width(center: FloatArray) -> float:
        return float(np.ptp(np.linalg.norm(ball - center, axis=1)))

    assert width(zone.surface.center) <= width(gauss.surface.center)
    assert zone.residuals.range == pytest.approx(width(zone.surface.center), rel=1e-9)
    assert zone.certificate is not None and gauss.certificate is None


def test_the_command_line_fits_the_same(command: Path, bore: FloatArray, tmp_path: Path) -> None:
    path = tmp_path / "bore.xyz"
    np.savetxt(path, bore, fmt="%.17g")
    flags = ["--type", "cylinder", "--axis", "0.48,0.64,0.6", "--outliers", "3"]
    done = subprocess.run([command, "fit", path, *flags], check=True, capture_output=True)
    result = conicoid.fit(path, type="cylinder", axis=TURN[2], outliers=3)
    assert result.to_dict() == json.loads(done.stdout)
    array = conicoid.fit(bore, type="cylinder", axis=TURN[2], outliers=3)
    assert array.surface == result.surface and array.input.format == "array"


def test_the_service_fits_the_same(service: str, bore: FloatArray) -> None:
    local = conicoid.fit(bore, type="cylinder").to_dict()
    remote = conicoid.Client(service).fit(bore, type="cylinder").to_dict()
    assert {**remote, "input": None} == {**local, "input": None}
    with pytest.raises(conicoid.CloudError):
        conicoid.Client(service).fit(bore[:4], type="cylinder")


def test_what_cannot_be_fitted_is_refused(bore: FloatArray) -> None:
    with pytest.raises(conicoid.UnknownParameterError, match="'min_points'"):
        conicoid.fit(bore, min_points=50)  # type: ignore[call-arg]
    with pytest.raises(conicoid.ParameterError, match="'type': 'blob'"):
        conicoid.fit(bore, type="blob")  # type: ignore[arg-type]
    with pytest.raises(conicoid.CloudError):
        conicoid.fit(bore[:4], type="cylinder")
    # a line leaves the plane about it free
    with pytest.raises(conicoid.CloudError) as error:
        conicoid.fit(np.outer(np.arange(9.0), [1, 2, 3]), type="plane")
    assert error.value.code == "not_determined"
    with pytest.raises(conicoid.ParameterError, match="the points are an array"):
        conicoid.fit(bore, columns=[1, 2, 3])
