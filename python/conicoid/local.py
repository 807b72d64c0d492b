"""Segmentation in this process."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from .parameters import given, reference
from .points import Cloud, native, read
from .records import FitDocument
from .segmentation import Segmentation, restored

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .records import FitKeywords, Keywords

__all__ = ["Progress", "fit", "load", "segment"]

#: What of a fit's parameters tells how a file is read.
_OF_FILES = ("format", "columns", "name", "deadline")

#: What is called with the name of the stage and the fraction of the work that is done, 0 to 1.
Progress = Callable[[str, float], object]


def segment(
    points: Any,
    *,
    progress: Progress | None = None,
    threads: int | None = None,
    **parameters: Unpack[Keywords],
) -> Segmentation:
    """Finds the surfaces in a point cloud.

    It runs on threads of its own without the GIL. Ctrl+C, or an exception from `progress`, stops it within milliseconds.

    Parameters
    ----------
    points
        An array (n, 3) of float64 or float32, in any memory order, which is copied once; what NumPy makes one of; a
        cloud that `read` gave; or the path of a file. Points that are NaN or infinite are left out and labelled -1.
    progress
        Called from this thread with the stage and the fraction of the work that is done, at most 20 times a second, and
        at the end with 1.
    threads
        How many threads; one a processor when None. The answer is the same.
    parameters
        Those of the table below, under the names that they have everywhere. None is as good as absent.

    Raises
    ------
    UnknownParameterError
        (a TypeError) No parameter has that name.
    ParameterError
        (a ValueError) A value is out of its range.
    CloudError
        (a ValueError) The cloud cannot be read, is too small, or cannot be worked with.
    DeadlineExceeded
        (a TimeoutError) It took longer than `deadline`.

    Examples
    --------
    >>> import numpy as np, conicoid
    >>> turn, height = np.random.default_rng(0).uniform([0, 0], [6.28, 30], (5000, 2)).T
    >>> pipe = np.column_stack([5 * np.cos(turn), 5 * np.sin(turn), height])
    >>> result = conicoid.segment(pipe, noise_sigma=0.001)
    >>> [(r.type, round(r.surface.radius, 6)) for r in result.regions]
    [('cylinder', 5.0)]
    """
    is_path = isinstance(points, (str, os.PathLike))
    if is_path:
        points = read(points, threads=threads, **parameters)
    cloud = points._native if isinstance(points, Cloud) else native(points)
    answer = _native.segment(cloud, given(parameters), progress, threads)
    return Segmentation(answer)


def fit(
    points: Any, *, threads: int | None = None, **parameters: Unpack[FitKeywords]
) -> FitDocument:
    """Fits one feature (plane, sphere, cylinder, cone, circle, line, ...) to all points.

    `points` and `threads` are as for `segment`; the table below has the parameters. Nothing is left out, unless
    ``outliers`` asks for it.

    Raises
    ------
    UnknownParameterError
        (a TypeError) No parameter has that name.
    ParameterError
        (a ValueError) A value is out of its range, or not for this type.
    CloudError
        (a ValueError) The points are too few for the feature, or do not determine it.

    Examples
    --------
    >>> import conicoid
    >>> bore = [[5, 0, 0], [0, 5, 1], [-5, 0, 2], [0, -5, 3], [4, 3, 4], [-3, 4, 5], [3, -4, 6]]
    >>> result = conicoid.fit(bore, type="cylinder")
    >>> round(result.surface.radius, 9)
    5.0
    """
    if isinstance(points, (str, os.PathLike)):
        of_files: dict[str, Any] = {name: parameters.get(name) for name in _OF_FILES}
        points = read(points, threads=threads, **of_files)
    cloud = points._native if isinstance(points, Cloud) else native(points)
    return FitDocument(json.loads(_native.fit(cloud, given(parameters), threads)))


# the one table has them
if segment.__doc__:
    segment.__doc__ += f"\n\n    Other Parameters\n    ----------------\n{reference()}\n"
if fit.__doc__:
    fit.__doc__ += f"\n\n    Other Parameters\n    ----------------\n{reference(fit=True)}\n"


def load(result: str | os.PathLike[str], points: Any, **options: Any) -> Segmentation:
    """The answer that a JSON file of the command line, the service or `save` holds, with its labels, about `points`.

    `points` are those that were segmented: an array, a cloud that `read` gave, or the path of the file, which `options`
    tell how to read as they tell `read`.
    """
    document = json.loads(Path(result).read_bytes())
    labels = document.pop("labels", None)
    if labels is None:
        raise ValueError(f"{os.fspath(result)} holds no labels: it was written with labels=none")
    if isinstance(points, (str, os.PathLike)):
        points = read(points, **options)
    array = points.points if isinstance(points, Cloud) else np.asarray(points)
    return restored(json.dumps(document).encode(), np.array(labels, np.int32), array, True)
