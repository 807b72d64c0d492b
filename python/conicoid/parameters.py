"""Parameters, under the names that they have everywhere."""

from __future__ import annotations

import json
import numbers
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._native import parameters as _native_parameters

__all__ = ["given", "parameters", "reference"]


def parameters(*, fit: bool = False) -> list[dict[str, Any]]:
    """The table of parameters: for each its ``name``, what it ``takes``, its ``unit``, ``default`` and ``help``.

    They are those of `segment`, or of `fit`.
    """
    return _native_parameters(fit)


def given(options: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Parameters as names and text, as queries give them; those that are None are left out."""
    return [(name, _text(name, value)) for name, value in options.items() if value is not None]


def _text(name: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, (list, tuple)) and any(isinstance(item, Mapping) for item in value):
        return json.dumps(value, default=_plain)
    if isinstance(value, (list, tuple, set, frozenset, np.ndarray)):
        items = sorted(value) if isinstance(value, (set, frozenset)) else value
        return ",".join(_text(name, item) for item in items)
    raise TypeError(f"parameter '{name}': a {type(value).__name__} is no text, number or list")


def _plain(value: Any) -> Any:
    """What JSON has no word for: arrays, NumPy's numbers, and objects of an answer."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"a {type(value).__name__} is no part of a parameter")


def reference(*, fit: bool = False) -> str:
    """The parameters for a docstring."""
    rows = []
    for row in parameters(fit=fit):
        unit = f", {row['unit']}" if row["unit"] else ""
        default = f"; default {row['default']}" if row["default"] is not None else ""
        rows.append(f"    {row['name']} : {row['takes']}{unit}{default}\n        {row['help']}.")
    return "\n".join(rows)
