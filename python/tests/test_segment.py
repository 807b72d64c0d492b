"""Segmentation in this process."""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import COUNTS, SIGMA, FloatArray, cylinder, without_times

import conicoid


def of_type(result: conicoid.Segmentation, name: str) -> conicoid.Region:
    (region,) = [region for region in result.regions if region.type == name]
    return region


def test_surfaces_are_found_where_they_are(found: conicoid.Segmentation) -> None:
    assert sorted(region.type for region in found.regions) == ["cylinder", "plane", "sphere"]
    tube, ball, plate = (of_type(found, name) for name in ("cylinder", "sphere", "plane"))
    for region, radius in [(tube, 8.0), (ball, 6.0)]:
        deviation = region.uncertainty.radius
        assert 0 < deviation < SIGMA / 10
        assert abs(region.surface.radius - radius) < 5 * deviation
    assert np.allclose(np.abs(tube.surface.axis_direction), [0, 0, 1], atol=1e-3)
    assert np.allclose(ball.surface.center, [20, 20, 14], atol=5 * SIGMA / 10)
    assert np.allclose(np.abs(plate.surface.normal), [0, 0, 1], atol=1e-3)
    assert tube.diameter == pytest.approx(16, abs=0.01)
    assert tube.dimensions.diameter == tube.diameter
    assert isinstance(tube.surface, conicoid.records.Cylinder)


def test_a_thinned_cloud_labels_every_point(part: FloatArray, found: conicoid.Segmentation) -> None:
    thin = conicoid.segment(part, thin=0.5)
    assert thin.input.thin is not None and thin.input.thin.length == 0.5
    assert thin.input.thin.kept < thin.input.points == len(part)
    assert found.input.thin is None
    assert sorted(region.type for region in thin.regions) == ["cylinder", "plane", "sphere"]
    assert len(thin.labels) == len(part) and thin.input.sha256 == found.input.sha256
    for region in thin.regions:
        assert region.point_count == (thin.labels == region.id).sum() > region.fit.used
    assert np.array_equal(np.isnan(thin.deviations), thin.labels < 0)
    assert thin.points.shape == part.shape


def test_labels_say_which_point_is_of_which_region(found: conicoid.Segmentation) -> None:
    first = 0
    for name, count in COUNTS.items():
        own = found.labels[first : first + count]
        assert np.mean(own == of_type(found, name).id) > 0.99, name
        first += count
    assert found.labels.dtype == np.int32 and len(found.labels) == first
    assert (found.labels == -1).sum() == found.unassigned.count
    for region in found.regions:
        assert len(found.points_of(region)) == len(found.points_of(region.id)) == region.point_count


def test_deviations_are_distances_from_the_own_surface(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    tube = of_type(found, "cylinder")
    surface, own = tube.surface, found.labels == tube.id
    along = part[own] - surface.axis_point
    height = along @ surface.axis_direction
    distance = np.linalg.norm(along - np.outer(height, surface.axis_direction), axis=1)
    assert np.allclose(found.deviations[own], distance - surface.radius, atol=1e-12)
    assert np.isnan(found.deviations[found.labels == -1]).all()
    assert np.sqrt(np.mean(found.deviations[own] ** 2)) == pytest.approx(tube.fit.rms, rel=1e-6)


def test_any_memory_order_gives_the_same_answer(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    wide = np.full((len(part), 7), 9.0)
    wide[:, 1:6:2] = part
    packed = np.empty(len(part), dtype=[("flag", "u1"), ("xyz", "<f8", 3)])
    packed["xyz"] = part
    for same in [
        packed["xyz"],
        np.asfortranarray(part),
        wide[:, 1:6:2],
        np.repeat(part, 2, axis=0)[::2],
        part[::-1][::-1],
        part.astype(">f8"),
        part.tolist(),
    ]:
        again = conicoid.segment(same)
        assert without_times(again.to_dict()) == without_times(found.to_dict())


def test_single_precision_is_taken_as_it_is(part: FloatArray) -> None:
    single = part.astype(np.float32)
    result = conicoid.segment(single[:, ::-1])
    double = conicoid.segment(single.astype(np.float64)[:, ::-1])
    assert without_times(result.to_dict()) == without_times(double.to_dict())
    assert np.array_equal(result.points, single[:, ::-1])


def test_points_that_are_not_finite_keep_their_places(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    holes = np.insert(part, [0, 700, 700, len(part)], np.nan, axis=0)
    holes[701, 1] = np.inf
    is_hole = ~np.isfinite(holes).all(axis=1)
    assert is_hole.sum() == 4
    for points in [holes, np.ma.masked_invalid(holes)]:
        result = conicoid.segment(points)
        assert (result.labels[is_hole] == -1).all()
        assert np.array_equal(result.labels[~is_hole], found.labels)
        assert result.input.skipped == 4 and result.unassigned.reasons["not_finite"] == 4
        assert np.isnan(result.points[is_hole]).all() and np.isnan(result.deviations[is_hole]).all()
        assert result.input.sha256 == hashlib.sha256(result.points.tobytes()).hexdigest()


def test_points_at_the_origin_are_holes_as_in_a_file(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    result = conicoid.segment(np.vstack([part, np.zeros((20, 3))]))
    assert result.input.skipped == 20 and np.isnan(result.points[-20:]).all()
    assert [warning.code for warning in result.warnings][-1] == "holes_at_origin"
    assert np.array_equal(result.labels[:-20], found.labels) and (result.labels[-20:] == -1).all()


def test_the_input_is_named_by_its_digest(part: FloatArray, found: conicoid.Segmentation) -> None:
    assert found.input.sha256 == hashlib.sha256(part.tobytes()).hexdigest()
    assert found.input.format == "array" and found.input.points == len(part)


def test_the_answer_is_the_same_on_any_number_of_threads(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    for threads in (1, 3):
        again = conicoid.segment(part, threads=threads)
        assert without_times(again.to_dict()) == without_times(found.to_dict())


def test_parameters_have_their_usual_names_and_any_usual_type(part: FloatArray) -> None:
    result = conicoid.segment(
        part,
        surfaces=["plane", "sphere"],
        min_points=np.int64(60),
        noise_sigma=np.float32(0.015625),
        axis_direction=np.array([0.0, 0.0, 2.0]),
        merge=False,
        max_radius=None,
        snap=True,
    )
    used = result.parameters
    assert used.surfaces == ["plane", "sphere"] and used.min_points == 60
    assert used.noise_sigma == 0.015625 and used.merge is False and used.max_radius is None
    assert result.snapping is not None and result.regions[0].snapped is not None
    assert {region.type for region in result.regions} == {"plane", "sphere"}


def test_a_wrong_parameter_is_refused_by_its_name_and_range(part: FloatArray) -> None:
    with pytest.raises(TypeError, match="unknown parameter 'radius'; known ones: .*tolerance") as one:
        conicoid.segment(part, radius=3)  # type: ignore[call-arg]
    assert isinstance(one.value, conicoid.UnknownParameterError)
    with pytest.raises(ValueError, match="'min_points': '9' is not a whole number from 10 to") as two:
        conicoid.segment(part, min_points=9)
    assert isinstance(two.value, conicoid.ParameterError) and two.value.code == "invalid_parameter"
    conicoid.segment(part, min_points=10)
    for wrong in [{"tolerance": float("nan")}, {"seed": 1.5}, {"surfaces": ["blob"]}]:
        with pytest.raises(conicoid.ParameterError, match=next(iter(wrong))):
            conicoid.segment(part, **wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="'tolerance': a dict"):
        conicoid.segment(part, tolerance={})  # type: ignore[arg-type]
    with pytest.raises(conicoid.ParameterError, match="the points are an array"):
        conicoid.segment(part, columns=[1, 2, 3])


@pytest.mark.parametrize(
    ("points", "kind", "told"),
    [
        (np.zeros((3, 100)), ValueError, r"pass points.T"),
        (np.zeros((100, 4)), ValueError, r"points\[:, :3\]"),
        (np.zeros((10, 10, 3)), ValueError, r"reshape\(-1, 3\)"),
        (np.zeros(9), ValueError, r"shape \(n, 3\), not \(9,\)"),
        (np.zeros((9, 3), complex), TypeError, "complex"),
        ([["a", "b", "c"]], TypeError, "numbers"),
        (np.zeros((0, 3)), conicoid.CloudError, "no points"),
        (np.full((60, 3), np.nan), conicoid.CloudError, "each of the 60 points"),
        (np.ones((49, 3)), conicoid.CloudError, "49 finite points; .* at least 50"),
        (np.ones((50, 3)), conicoid.CloudError, "extent"),
        (np.zeros((50, 3)), conicoid.CloudError, "each of the 50 points"),
        (np.eye(3)[[0, 1, 2] * 20] * 1e60, conicoid.CloudError, "1e60"),
    ],
)
def test_what_is_no_cloud_is_refused(points: object, kind: type[Exception], told: str) -> None:
    with pytest.raises(kind, match=told):
        conicoid.segment(points)


def test_progress_is_told_and_grows_to_one(part: FloatArray) -> None:
    told: list[tuple[str, float]] = []
    conicoid.segment(np.vstack([part + [100 * k, 0, 0] for k in range(8)]), progress=lambda *now: told.append(now))
    fractions = [fraction for _, fraction in told]
    assert fractions == sorted(fractions) and told[-1] == ("report", 1.0) and len(told) > 1


def test_an_exception_from_progress_stops_the_work(part: FloatArray) -> None:
    def stop(stage: str, fraction: float) -> None:
        raise LookupError(stage)

    with pytest.raises(LookupError):
        conicoid.segment(cylinder(2_000_000, 50, 100, 0.05, 1), progress=stop)


def test_a_deadline_ends_the_work() -> None:
    with pytest.raises(TimeoutError, match="raise deadline") as error:
        conicoid.segment(cylinder(2_000_000, 50, 100, 0.05, 1), deadline=0.1)
    assert isinstance(error.value, conicoid.DeadlineExceeded)


INTERRUPTED = """
import conicoid, numpy as np, sys
points = np.random.default_rng(0).uniform(size=(3_000_000, 3))
try:
    conicoid.segment(points, progress=lambda *_: print("go", flush=True))
except KeyboardInterrupt:
    print("stopped", flush=True)
"""


def test_the_keyboard_interrupts() -> None:
    process = subprocess.Popen([sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, text=True)
    assert process.stdout and process.stdout.readline() == "go\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[0].endswith("stopped\n")
    assert process.returncode == 0


def test_other_threads_of_python_run_meanwhile(part: FloatArray) -> None:
    beats, stop = [], threading.Event()

    def beat() -> None:
        while not stop.wait(0.005):
            beats.append(time.monotonic())

    thread = threading.Thread(target=beat)
    thread.start()
    begin = time.monotonic()
    conicoid.segment(np.vstack([part + [100 * k, 0, 0] for k in range(8)]))
    seconds = time.monotonic() - begin
    stop.set()
    thread.join()
    # next to none where the work keeps the interpreter to itself
    assert len(beats) > 3 * seconds


def test_two_threads_may_segment_at_once(part: FloatArray, found: conicoid.Segmentation) -> None:
    results: list[conicoid.Segmentation] = []
    work = lambda: results.append(conicoid.segment(part))  # noqa: E731
    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results:
        assert without_times(result.to_dict()) == without_times(found.to_dict())
    assert len(results) == 3


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_segments_too(part: FloatArray, found: conicoid.Segmentation) -> None:
    # its parent has used the pool of threads, of which the child has none
    with multiprocessing.get_context("fork").Pool(1) as pool:
        result = pool.apply_async(conicoid.segment, (part,)).get(timeout=120)
    assert without_times(result.to_dict()) == without_times(found.to_dict())
    assert np.array_equal(result.deviations, found.deviations, equal_nan=True)


def test_clouds_of_other_packages_are_taken_by_their_points(
    part: FloatArray, found: conicoid.Segmentation
) -> None:
    class Cloud:
        points = part

    class Mesh:
        vertices = part

    pandas = pytest.importorskip("pandas")
    for cloud in [Cloud(), Mesh(), pandas.DataFrame(part, columns=["x", "y", "z"])]:
        assert np.array_equal(conicoid.segment(cloud).labels, found.labels)
