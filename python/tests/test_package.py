"""The package itself: its types follow the contract, its parameters the one table, its examples run."""

from __future__ import annotations

import importlib.util
import inspect
import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import pytest

import conicoid
from conicoid import records
from conicoid.record import Record

HERE = Path(__file__).resolve().parent


def test_the_records_are_those_of_the_contract() -> None:
    path = HERE.parent / "tools" / "records.py"
    spec = importlib.util.spec_from_file_location("tools_records", path)
    assert spec and spec.loader
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    installed = Path(inspect.getfile(records)).read_text()
    assert installed == tool.made(), "the contract has changed: run python/tools/records.py"


def test_a_field_that_is_called_like_a_method_has_an_underscore() -> None:
    methods = {name for name in dir(Record) if not name.startswith("_")}
    classes = [c for c in vars(records).values() if isinstance(c, type) and issubclass(c, Record)]
    assert len(classes) > 20
    for record in classes:
        one = record({name: "x" for name in record._fields})
        for name in record._fields:
            assert getattr(one, f"{name}_" if name in methods else name) == one[name] == "x"
        assert callable(one.values) and len(one.values()) == len(one)


def test_every_answer_is_described(found: conicoid.Segmentation) -> None:
    def check(record: Record) -> None:
        for name in record:
            assert name in record._fields, f"{type(record).__name__} has no {name}"
            inner = record[name]
            for item in inner if isinstance(inner, list) else [inner]:
                if isinstance(item, Record):
                    check(item)
                else:
                    assert not isinstance(item, Mapping) or not record._fields[name]

    check(found)


def test_parameters_are_those_of_the_table() -> None:
    names = [row["name"] for row in conicoid.parameters()]
    assert set(records.Keywords.__annotations__) == set(names) and "tolerance" in names
    for row in conicoid.parameters():
        assert row["takes"] and row["help"]
        assert f"{row['name']} : " in (conicoid.segment.__doc__ or "")
    names = [row["name"] for row in conicoid.parameters(fit=True)]
    assert set(records.FitKeywords.__annotations__) == set(names) and "association" in names
    for name in names:
        assert f"{name} : " in (conicoid.fit.__doc__ or "")


def test_the_package_has_the_version_of_the_library(found: conicoid.Segmentation) -> None:
    assert conicoid.__version__ == found.conicoid == version("conicoid")


def test_everything_public_is_described() -> None:
    for name in conicoid.__all__:
        thing = getattr(conicoid, name)
        assert thing.__doc__, name
        for member, value in vars(thing).items() if isinstance(thing, type) else []:
            is_told = callable(value) or isinstance(value, property)
            assert member.startswith("_") or not is_told or value.__doc__, f"{name}.{member}"


def test_types_are_right(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    # the package by its configuration, and each example by itself
    examples = sorted((HERE.parent / "examples").glob("*.py"))
    for what in [[], *([str(path)] for path in examples)]:
        arguments = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path), *what]
        done = subprocess.run(arguments, capture_output=True, text=True, cwd=HERE.parent)
        assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("name", "needs"), [("part.py", ["matplotlib", "pandas"]), ("with_open3d.py", ["open3d"])]
)
def test_an_example_runs(name: str, needs: list[str], tmp_path: Path) -> None:
    for module in needs:
        pytest.importorskip(module)
    path = HERE.parent / "examples" / name
    arguments = [sys.executable, str(path)]
    done = subprocess.run(arguments, capture_output=True, text=True, cwd=tmp_path, env=_headless())
    assert done.returncode == 0, done.stderr
    assert "cylinder" in done.stdout and list(tmp_path.iterdir())


def _headless() -> dict[str, str]:
    return {**os.environ, "MPLBACKEND": "Agg"}
