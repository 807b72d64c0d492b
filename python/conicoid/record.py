"""What an answer holds, as objects with attributes."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np

__all__ = ["Record", "plain"]


class Record(Mapping[str, Any]):
    """One object of an answer: its fields are attributes, and items under the same names.

    The attribute of a field that is called like a method ends in an underscore: ``residuals.values_``.
    A field that the contract leaves out where there is none is ``None`` as an attribute, an empty list where it is one of
    several, and absent as an item. Lists of numbers are read-only NumPy arrays of float64.
    """

    __slots__ = ("_cache", "_data")

    #: Every field that the contract has, with the names of the classes it may be of.
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {}
    #: Those that are lists wherever they are there.
    _lists: ClassVar[frozenset[str]] = frozenset()

    _data: Mapping[str, Any]
    _cache: dict[str, Any]

    def __init__(self, data: Mapping[str, Any]) -> None:
        object.__setattr__(self, "_data", data)
        object.__setattr__(self, "_cache", {})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name.endswith("_") and hasattr(Record, name[:-1]):
            # the method has the name without an underscore
            name = name[:-1]
        if name in self._data:
            return self[name]
        if name in self._fields:
            return [] if name in self._lists else None
        known = ", ".join(sorted({*self._fields, *self._data}))
        raise AttributeError(f"{type(self).__name__} has no field '{name}'; it has {known}")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} cannot be changed; to_dict() gives a copy that can")

    def __getitem__(self, name: str) -> Any:
        if name not in self._cache:
            classes = self._fields.get(name, ())
            self._cache[name] = _read(self._data[name], classes)
        return self._cache[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def __len__(self) -> int:
        return len(self._data)

    def __eq__(self, other: object) -> bool:
        return self._data == other._data if isinstance(other, Record) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._fields})

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={_short(value)}" for name, value in self._data.items())
        return f"{type(self).__name__}({shown})"

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self.to_dict(),))

    def to_dict(self) -> dict[str, Any]:
        """A copy as plain dictionaries, lists, numbers and text, as in the service's JSON."""
        return {name: plain(value) for name, value in self._data.items()}


def plain(value: Any) -> Any:
    """A copy of a value of JSON."""
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return value


def _read(value: Any, classes: tuple[str, ...]) -> Any:
    if isinstance(value, dict):
        return _class_of(value, classes)(value) if classes else dict(value)
    if isinstance(value, list):
        if _is_numbers(value):
            array = np.array(value, dtype=np.float64)
            array.flags.writeable = False
            return array
        return [_read(item, classes) for item in value]
    return value


def _class_of(value: Mapping[str, Any], names: tuple[str, ...]) -> type[Record]:
    """Of several classes the one whose fields are most of those that are there."""
    # they are made from the contract, on top of this module
    records = sys.modules["conicoid.records"]
    classes = [getattr(records, name) for name in names]
    fitting = [c for c in classes if all(name in c._fields for name in value)]
    best: type[Record] = max(fitting or classes, key=lambda c: -len(c._fields))
    return best


def _is_numbers(value: list[Any]) -> bool:
    """Whether it is a list of floating point numbers, or of lists of as many of those each."""
    if not value:
        return False
    if isinstance(value[0], list):
        return all(isinstance(v, list) and len(v) == len(value[0]) and _is_numbers(v) for v in value)
    return all(type(v) is float for v in value)


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{...}"
    if isinstance(value, list) and len(value) > 3:
        return f"[... {len(value)}]"
    if isinstance(value, list):
        return f"[{', '.join(_short(item) for item in value)}]"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)
