"""The answer to a segmentation."""

from __future__ import annotations

import json
import os
import tempfile
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from ._native import colors
from ._native import restored as native_restored
from .errors import ParameterError
from .record import plain
from .records import Document, Region

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["Segmentation"]


class Source(Protocol):
    """Where an answer comes from: the library in process, or a service."""

    @property
    def has_labels(self) -> bool: ...
    def document(self) -> bytes: ...
    def labels(self) -> npt.NDArray[np.int32]: ...
    def face_labels(self) -> npt.NDArray[np.int32] | None: ...
    def deviations(self) -> npt.NDArray[np.float64]: ...
    def points(self) -> npt.NDArray[np.float64]: ...
    def write(self, ending: str, labels: bool) -> bytes: ...


class Segmentation(Document):
    """The surfaces that were found in a cloud.

    Beside the fields of the document (`regions`, `relations`, `unassigned`, `parameters`, `warnings`, ...) it has arrays
    with one entry a point, in the order of the input.
    """

    __slots__ = ("_arrays", "_source")

    _source: Source
    _arrays: dict[str, npt.NDArray[Any]]

    def __init__(self, source: Source) -> None:
        super().__init__(json.loads(source.document()))
        object.__setattr__(self, "_source", source)
        object.__setattr__(self, "_arrays", {})

    def _array(self, name: str) -> npt.NDArray[Any]:
        if name not in self._arrays:
            array: npt.NDArray[Any] = getattr(self._source, name)()
            array.flags.writeable = False
            self._arrays[name] = array
        return self._arrays[name]

    @property
    def labels(self) -> npt.NDArray[np.int32]:  # type: ignore[override]
        """One label for each point, int32: the place of its region in `regions`; -1 = unassigned."""
        return self._array("labels")

    @property
    def face_labels(self) -> npt.NDArray[np.int32] | None:  # type: ignore[override]
        """One label for each face of a mesh whose faces were sampled, int32; None for other clouds.

        That of most of its samples; -1 = unassigned, or without an area.
        """
        samples = self.input.mesh is not None and self.input.mesh.points == "samples"
        return self._array("face_labels") if samples else None

    @property
    def deviations(self) -> npt.NDArray[np.float64]:
        """The signed distance of each point from the surface of its region; NaN where it has none.

        Positive outside: away from an axis or a centre, on a plane on the side of its normal.
        """
        return self._array("deviations")

    @property
    def points(self) -> npt.NDArray[np.float64]:
        """The points as they were worked with, float64 (n, 3); NaN where a coordinate is not finite."""
        return self._array("points")

    @property
    def colors(self) -> npt.NDArray[np.uint8]:
        """The colour of each point, uint8 (n, 3): that of its region in the report and the viewer; grey = unassigned."""
        return _palette(len(self.regions))[self.labels]

    def points_of(self, region: Region | int) -> npt.NDArray[np.float64]:
        """The points of a region, given itself or by its id; those of no region for -1."""
        label = region if isinstance(region, (int, np.integer)) else region.id
        own: npt.NDArray[np.float64] = self.points[self.labels == label]
        return own

    def to_dict(self, labels: bool | None = None) -> dict[str, Any]:
        """The document as the service's JSON has it, as plain dictionaries, lists, numbers and text.

        `labels` says whether it holds the labels; what the parameter of that name says when None.
        """
        document = {name: plain(value) for name, value in self._data.items()}
        if self._source.has_labels if labels is None else labels:
            document["labels"] = self.labels.tolist()
            if self.face_labels is not None:
                document["face_labels"] = self.face_labels.tolist()
        return document

    def to_json(self, labels: bool | None = None) -> str:
        """The document as JSON, as the service and the command line write it."""
        return self._written("json", labels).decode()

    def _written(self, ending: str, labels: bool | None) -> bytes:
        return self._source.write(ending, self._source.has_labels if labels is None else labels)

    def save(self, path: str | os.PathLike[str], labels: bool | None = None) -> None:
        """Writes a file in the form that its ending names; it is there when it is whole.

        ``.json`` the document, ``.step`` (``.stp``) a boundary representation for CAD systems, ``.ply`` the points with
        label, colour and deviation, ``.csv`` one line a region, ``.points.csv`` one line a point, ``.faces.csv`` one
        line a face of a mesh that was sampled, ``.npy`` the labels, ``.deviations.npy`` the deviations, ``.html`` a report,
        ``.png`` a picture; ``.qif``, ``.dmo`` (DMIS) and ``.characteristics.csv`` for inspection software.

        Raises
        ------
        ParameterError
            The ending names no form.
        """
        target = Path(os.fspath(path))
        endings = target.name.lower().split(".")[1:]
        # the longest comes first: one form may end as another does
        names = [".".join(endings[k:]) for k in range(len(endings))]
        ending = next((name for name in names if name in ENDINGS), None)
        if ending is None:
            known = ", ".join(f".{name}" for name in ENDINGS)
            raise ParameterError(
                "not_acceptable", f"the ending of {target} names no form: end it in {known}"
            )
        _replace(target, self._written(ending, labels) + (b"\n" if ending == "json" else b""))

    def to_pandas(self) -> pandas.DataFrame:
        """One row a region, as in the ``.csv`` form: sizes, places, coefficients; angles of dimensions in degrees.

        Needs pandas.
        """
        import io

        import pandas

        frame = pandas.read_csv(io.BytesIO(self._source.write("csv", False)))
        return frame.set_index("id")

    def to_open3d(self, split: bool = False) -> Any:
        """An `open3d.geometry.PointCloud` in the colours of the regions, without the points that are not finite.

        With `split` a list: one cloud a region, in their order, then that of the points of no region. Needs Open3D.
        """
        import open3d

        def cloud(chosen: Any) -> Any:
            made = open3d.geometry.PointCloud()
            made.points = open3d.utility.Vector3dVector(self.points[chosen])
            made.colors = open3d.utility.Vector3dVector(self.colors[chosen] / 255.0)
            return made

        finite = np.isfinite(self.points).all(axis=1)
        if not split:
            return cloud(finite)
        labels = [*range(len(self.regions)), -1]
        return [cloud(finite & (self.labels == label)) for label in labels]

    def plot(self, ax: Axes | None = None, most_points: int = 50_000, **options: Any) -> Axes:
        """The points in the colours of their regions, on Matplotlib's 3D axes; needs Matplotlib.

        Of more than `most_points` points evenly chosen ones are drawn. `options` go to `scatter`.
        """
        from .plotting import plot

        return plot(self, ax, most_points, options)

    def __repr__(self) -> str:
        types = Counter(region.type for region in self.regions)
        found = ", ".join(f"{count} {name}" for name, count in types.most_common())
        n = len(self.regions)
        surfaces = f"{n} region{'s' * (n != 1)}" + (f" ({found})" if found else "")
        left = self.unassigned.count
        return f"<Segmentation of {self.input.points} points: {surfaces}, {left} unassigned>"

    def _repr_html_(self) -> str:
        rows = "".join(_row(region) for region in self.regions[:100])
        more = f"<p>and {len(self.regions) - 100} more</p>" if len(self.regions) > 100 else ""
        text = repr(self)[1:-1]
        head = "<tr><th>id<th>type<th>points<th>rms<th>diameter<th>length<th>side</tr>"
        return f"<p>{text}</p><table>{head}{rows}</table>{more}"

    def __reduce__(self) -> tuple[Any, ...]:
        source = self._source
        document = source.document()
        if self.face_labels is not None:
            whole = {**json.loads(document), "face_labels": self.face_labels.tolist()}
            document = json.dumps(whole).encode()
        return (restored, (document, self.labels, self.points, source.has_labels))


#: The endings that `save` knows.
ENDINGS = (
    "json",
    "step",
    "stp",
    "ply",
    "csv",
    "points.csv",
    "faces.csv",
    "characteristics.csv",
    "qif",
    "dmo",
    "npy",
    "deviations.npy",
    "html",
    "png",
)


def _palette(regions: int) -> npt.NDArray[np.uint8]:
    """The colour of each region; that of the label -1 last, where an index of -1 finds it."""
    return np.frombuffer(b"".join(colors(regions)), dtype=np.uint8).reshape(-1, 3)


def _row(region: Region) -> str:
    def number(value: float | None) -> str:
        return "" if value is None else f"{value:.6g}"

    cells = [str(region.id), region.type, str(region.point_count), number(region.fit.rms)]
    cells += [number(region.diameter), number(region.length), region.side or ""]
    return "<tr>" + "".join(f"<td>{cell}" for cell in cells) + "</tr>"


def _replace(target: Path, data: bytes) -> None:
    """Writes a file whole or not at all."""
    if target.exists() and not target.is_file():
        target.write_bytes(data)
        return
    handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        # as a file that is made anew has it, or as it was
        umask = os.umask(0)
        os.umask(umask)
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~umask
        os.chmod(draft, mode)
        os.replace(draft, target)
    except BaseException:
        os.unlink(draft)
        raise


def restored(
    document: bytes, labels: npt.NDArray[np.int32], points: Any, has_labels: bool
) -> Segmentation:
    """The answer whose document and labels these are, about `points`."""
    return Segmentation(native_restored(document, labels, points, has_labels))
