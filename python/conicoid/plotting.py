"""Pictures with Matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .segmentation import Segmentation

__all__ = ["plot"]


def plot(
    result: Segmentation, ax: Axes | None, most_points: int, options: dict[str, Any]
) -> Axes:
    """The points of `result` in the colours of their regions, with equal scales along all axes."""
    if ax is None:
        import matplotlib.pyplot as plt

        axes: Any = plt.figure().add_subplot(projection="3d")
    else:
        axes = ax
    shown = np.flatnonzero(np.isfinite(result.points).all(axis=1))
    if len(shown) > most_points:
        shown = shown[np.linspace(0, len(shown) - 1, most_points).round().astype(np.intp)]
    labels, colors = result.labels[shown], result.colors[shown] / 255.0
    for label in np.unique(labels):
        own = shown[labels == label]
        name = "unassigned" if label < 0 else f"{label} {result.regions[label].type}"
        color = colors[labels == label][0]
        axes.scatter(*result.points[own].T, **{"s": 1, "color": color, "label": name, **options})
    axes.set_xlabel("x")
    axes.set_ylabel("y")
    axes.set_zlabel("z")
    axes.set_aspect("equal")
    return axes  # type: ignore[no-any-return]
