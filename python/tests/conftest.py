"""Clouds with known truth, and the command and service that answers are compared with."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import conicoid

ROOT = Path(__file__).resolve().parent.parent.parent
FloatArray = npt.NDArray[np.float64]


def cylinder(n: int, radius: float, length: float, sigma: float, seed: int) -> FloatArray:
    """Points of a tube about the z axis, from z = 0 to `length`, with normal noise along its normals."""
    random = np.random.default_rng(seed)
    turn = random.uniform(0, 2 * np.pi, n)
    r = radius + sigma * random.standard_normal(n)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), random.uniform(0, length, n)])


def plane(n: int, side: float, sigma: float, seed: int) -> FloatArray:
    """Points of a square about the origin at z = 0, with normal noise."""
    random = np.random.default_rng(seed)
    xy = random.uniform(-side / 2, side / 2, (n, 2))
    return np.column_stack([xy, sigma * random.standard_normal(n)])


def sphere(n: int, radius: float, sigma: float, seed: int) -> FloatArray:
    """Points of a ball about the origin, with normal noise."""
    random = np.random.default_rng(seed)
    direction = random.standard_normal((n, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return direction * (radius + sigma * random.standard_normal(n))[:, None]


SIGMA = 0.01
#: Of `part`: what lies where, and how many points of each.
COUNTS = {"plane": 6000, "cylinder": 5000, "sphere": 4000}


@pytest.fixture(scope="session")
def part() -> FloatArray:
    """A plate of 60 x 60 at z = 0, a tube of radius 8 on it, and a ball of radius 6 at (20, 20, 14)."""
    pieces = [
        plane(COUNTS["plane"], 60, SIGMA, 1),
        cylinder(COUNTS["cylinder"], 8, 25, SIGMA, 2),
        sphere(COUNTS["sphere"], 6, SIGMA, 3) + [20, 20, 14],
    ]
    return np.vstack(pieces)


@pytest.fixture(scope="session")
def found(part: FloatArray) -> conicoid.Segmentation:
    """The answer about `part`."""
    return conicoid.segment(part)


@pytest.fixture(scope="session")
def part_file(part: FloatArray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`part` as a binary PLY file with an intensity."""
    path = tmp_path_factory.mktemp("clouds") / "part.ply"
    write_ply(path, part, np.arange(len(part), dtype="<u2"))
    return path


def write_ply(path: Path, points: FloatArray, intensity: npt.NDArray[np.uint16]) -> None:
    """Writes points as double and an intensity as ushort."""
    kinds = [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("intensity", "<u2")]
    rows = np.empty(len(points), dtype=kinds)
    rows["x"], rows["y"], rows["z"] = points.T
    rows["intensity"] = intensity
    names = "".join(f"property double {name}\n" for name in "xyz") + "property ushort intensity\n"
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{names}end_header\n"
    path.write_bytes(head.encode() + rows.tobytes())


def without_times(document: dict[str, object]) -> dict[str, object]:
    """A document without what differs between two runs."""
    return {name: value for name, value in document.items() if name != "timing"}


@pytest.fixture(scope="session")
def command() -> Path:
    """The command line, of this tree or of the variable COMMAND_UNDER_TEST."""
    path = Path(os.environ.get("COMMAND_UNDER_TEST", ROOT / "target" / "release" / "conicoid"))
    if not path.exists():
        pytest.skip(f"{path} is not built: cargo build --release")
    return path


class Running:
    """A service of its own."""

    def __init__(self, command: Path, *flags: str) -> None:
        ports = ["--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--admin", "127.0.0.1:0"]
        arguments = [str(command), "serve", *ports, *flags]
        self.process = subprocess.Popen(
            arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self.process.stdout
        addresses = dict(self.process.stdout.readline().split("://", 1) for _ in range(3))
        self.url = f"http://{addresses['http'].strip()}"

    def stop(self) -> None:
        self.process.terminate()
        self.process.communicate(timeout=60)


@pytest.fixture(scope="session")
def service(command: Path) -> Iterator[str]:
    """The URL of a running service."""
    running = Running(command)
    yield running.url
    running.stop()
