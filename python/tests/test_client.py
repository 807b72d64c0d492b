"""The service by its client: the same answers, and errors of the same kinds."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest
from conftest import FloatArray, Running, cylinder, without_times

import conicoid


def told(result: conicoid.Segmentation) -> dict[str, object]:
    """A document without its times and what it says of the bytes the cloud came in."""
    return without_times({k: v for k, v in result.to_dict().items() if k != "input"})


def test_the_service_says_the_same(
    service: str, part: FloatArray, found: conicoid.Segmentation
) -> None:
    result = conicoid.Client(service).segment(part)
    assert told(result) == told(found)
    assert np.array_equal(result.labels, found.labels) and result.labels.dtype == np.int32
    assert np.array_equal(result.deviations, found.deviations, equal_nan=True)
    assert np.array_equal(result.points, found.points)
    assert np.array_equal(result.colors, found.colors)
    assert type(result) is type(found) and repr(result) == repr(found)


def test_a_file_is_sent_as_it_is(
    service: str, part_file: Path, tmp_path: Path
) -> None:
    local, result = conicoid.segment(part_file), conicoid.Client(service).segment(part_file)
    assert without_times(result.to_dict()) == without_times(local.to_dict())
    endings = ["ply", "step", "csv", "points.csv", "deviations.npy", "npy", "html", "png", "dmo"]
    for ending in [*endings, "characteristics.csv"]:
        result.save(tmp_path / f"remote.{ending}")
        local.save(tmp_path / f"local.{ending}")
        remote = (tmp_path / f"remote.{ending}").read_bytes()
        assert remote == (tmp_path / f"local.{ending}").read_bytes(), ending
    assert result.to_json(labels=False) == result._source.document().decode()
    result.save(tmp_path / "remote.json")
    assert (tmp_path / "remote.json").read_text() == result.to_json() + "\n"


def test_any_array_is_sent_with_its_holes_and_its_precision(
    service: str, part: FloatArray
) -> None:
    points = np.asfortranarray(part.astype(np.float32))
    points[5] = np.nan
    points[9, 2] = np.inf
    local, result = conicoid.segment(points), conicoid.Client(service).segment(points[:, ::1])
    assert told(result) == told(local) and result.input.skipped == 2
    assert np.array_equal(result.points, local.points, equal_nan=True)
    assert conicoid.Client(service).segment(points, labels="none").to_dict().get("labels") is None


def test_progress_is_told(service: str, part: FloatArray) -> None:
    told: list[tuple[str, float]] = []
    conicoid.Client(service).segment(part, progress=lambda *now: told.append(now))
    fractions = [fraction for _, fraction in told]
    assert fractions == sorted(fractions) and told[-1][1] == 1.0


def test_a_job_goes_on_by_itself(service: str, part: FloatArray) -> None:
    client = conicoid.Client(service + "/")
    job = client.submit(part, name="ball & tube", min_points=60)
    again = client.job(job.id)
    result = again.wait().result(timeout=60)
    assert again.state == "succeeded" and again.id == job.id and again.id in repr(again)
    assert result.parameters.min_points == 60
    # nothing of the cloud is here any more
    assert np.array_equal(result.points, part)
    assert np.array_equal(job.result().labels, result.labels)
    job.cancel()
    with pytest.raises(conicoid.ServiceError) as error:
        client.job(job.id)
    assert (error.value.code, error.value.status) == ("job_not_found", 404) and error.value.request_id


def test_a_job_that_takes_too_long_may_be_left_or_cancelled(service: str) -> None:
    job = conicoid.Client(service).submit(cylinder(1_000_000, 50, 100, 0.05, 1))
    with pytest.raises(TimeoutError, match="it goes on"):
        job.wait(timeout=0.05)
    job.cancel()
    with pytest.raises(conicoid.Cancelled):
        job.result(timeout=60)


def test_an_exception_from_progress_cancels_the_job(service: str) -> None:
    client = conicoid.Client(service)
    jobs: list[conicoid.Job] = []
    submit = client.submit
    client.submit = lambda *a, **k: jobs.append(submit(*a, **k)) or jobs[-1]  # type: ignore

    def stop(stage: str, fraction: float) -> None:
        raise LookupError(stage)

    with pytest.raises(LookupError):
        client.segment(cylinder(1_000_000, 50, 100, 0.05, 1), progress=stop)
    assert jobs[0].refresh().wait(timeout=60).state == "cancelled"


INTERRUPTED = """
import conicoid, numpy as np, sys
points = np.random.default_rng(0).uniform(size=(1_000_000, 3))
try:
    conicoid.Client(sys.argv[1]).segment(points, progress=lambda *_: print("go", flush=True))
except KeyboardInterrupt:
    print("stopped", flush=True)
"""


def test_the_keyboard_interrupts(service: str) -> None:
    arguments = [sys.executable, "-c", INTERRUPTED, service]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    assert process.stdout and process.stdout.readline() == "go\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[0].endswith("stopped\n") and process.returncode == 0


def test_errors_are_of_the_same_kinds_as_in_this_process(service: str, tmp_path: Path) -> None:
    client, few = conicoid.Client(service), np.random.default_rng(0).uniform(size=(49, 3))
    text = tmp_path / "page.html"
    text.write_text("<html><body>hello</body></html>")
    cases: list[tuple[object, dict[str, object]]] = [
        (few, {}),
        (np.ones((60, 3)), {}),
        (few, {"radius": 3}),
        (few, {"min_points": 9}),
        (text, {}),
        (text, {"format": "ply"}),
    ]
    for points, parameters in cases:
        with pytest.raises(conicoid.Error) as local:
            conicoid.segment(points, **parameters)  # type: ignore[arg-type]
        with pytest.raises(conicoid.Error) as remote:
            client.segment(points, **parameters)  # type: ignore[arg-type]
        assert type(local.value) is type(remote.value), points
        assert local.value.code == remote.value.code and str(local.value) == str(remote.value)
    with pytest.raises(FileNotFoundError):
        client.segment(tmp_path / "none.ply")


def test_a_key_is_sent_where_it_is_asked_for(
    command: Path, part: FloatArray, tmp_path: Path
) -> None:
    made = subprocess.run([command, "key", "tests"], capture_output=True, text=True, check=True)
    key = made.stderr.split()[-1]
    (tmp_path / "keys").write_text(made.stdout)
    running = Running(command, "--keys", str(tmp_path / "keys"))
    try:
        for wrong in (None, "wrong"):
            with pytest.raises(conicoid.ServiceError) as error:
                conicoid.Client(running.url, wrong).segment(part)
            assert (error.value.code, error.value.status) == ("unauthenticated", 401)
        assert len(conicoid.Client(running.url, key).segment(part).regions) == 3
    finally:
        running.stop()


def test_a_service_that_is_not_there_is_told() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(conicoid.ConnectionFailed, match=url) as error:
        conicoid.Client(url).segment(np.zeros((60, 3)))
    assert isinstance(error.value, ConnectionError)
    with pytest.raises(ValueError, match="http:// or https://"):
        conicoid.Client("127.0.0.1:8080")


class Busy(BaseHTTPRequestHandler):
    """Says twice that it is busy, then refuses for good."""

    bodies: list[bytes] = []

    def do_POST(self) -> None:
        self.bodies.append(self.rfile.read(int(self.headers["content-length"])))
        is_busy = len(self.bodies) < 3
        body = b'{"code": "overloaded", "detail": "try again later"}' if is_busy else b"<p>no</p>"
        self.send_response(503 if is_busy else 502)
        if is_busy:
            self.send_header("retry-after", "0")
        self.send_header("content-length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        pass


def test_a_busy_service_is_asked_again_with_the_whole_cloud(part: FloatArray) -> None:
    server = HTTPServer(("127.0.0.1", 0), Busy)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        url = f"http://127.0.0.1:{server.server_port}"
        with pytest.raises(conicoid.ServiceError, match="HTTP status 502: <p>no</p>"):
            conicoid.Client(url).submit(part)
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
    assert len(Busy.bodies) == 3 and len(set(Busy.bodies)) == 1
    assert Busy.bodies[0].endswith(part.tobytes())


def test_a_large_cloud_is_sent_in_pieces(service: str, tmp_path: Path) -> None:
    path = tmp_path / "large.ply"
    n = 2_000_000
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 2000000\n"
    head += "".join(f"property double {name}\n" for name in "xyz") + "end_header\n"
    path.write_bytes(head.encode() + cylinder(n, 50, 100, 0.05, 1).tobytes())
    code = (
        "import conicoid, resource, sys; client = conicoid.Client(sys.argv[1]); "
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; before = peak(); "
        "client.submit(sys.argv[2]).cancel(); print(peak() - before)"
    )
    arguments = [sys.executable, "-c", code, service, str(path)]
    grown = subprocess.run(arguments, capture_output=True, text=True, check=True).stdout
    # of the 48 MB hardly any are held
    assert int(grown) < 12_000, f"{grown} KiB"
    assert os.path.getsize(path) > 48_000_000
