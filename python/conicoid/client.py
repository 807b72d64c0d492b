"""The service over HTTP, with the same answers."""

from __future__ import annotations

import io
import json
import os
import ssl
import time
import uuid
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

import numpy as np
import numpy.typing as npt

from .body import body_of, named
from .errors import Cancelled, Error, of_code
from .points import read as read_cloud
from .records import FitDocument
from .segmentation import Segmentation
from .transport import Transport

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .local import Progress
    from .records import FitKeywords, Keywords

__all__ = ["Client", "Job"]

#: The media types of the forms that `save` knows.
_MEDIA_TYPES = {
    "json": "application/json",
    "npy": "application/x-npy",
    "ply": "model/ply",
    "csv": "text/csv",
    "deviations.npy": "application/vnd.conicoid.deviations+npy",
    "points.csv": "application/vnd.conicoid.points+csv",
    "faces.csv": "application/vnd.conicoid.faces+csv",
    "qif": "application/vnd.conicoid.qif+xml",
    "dmo": "application/vnd.conicoid.dmis",
    "characteristics.csv": "application/vnd.conicoid.characteristics+csv",
    "step": "model/step",
    "stp": "model/step",
    "html": "text/html",
    "png": "image/png",
}


class Client:
    """A service of conicoid.

    Parameters
    ----------
    url
        Where its HTTP listener is, such as ``http://127.0.0.1:8080`` (the default).
    key
        The API key, where the service asks for one.
    timeout
        Seconds without a byte from the service after which the connection counts as broken.
    patience
        Seconds for which a request is tried again where the service says that it has too much work at hand.
    context
        What TLS trusts and shows: ``ssl.create_default_context(cafile=...)``, with ``load_cert_chain`` for a certificate
        of one's own.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        key: str | None = None,
        *,
        timeout: float = 60.0,
        patience: float = 60.0,
        context: ssl.SSLContext | None = None,
    ) -> None:
        self._transport = Transport(url, key, timeout, patience, context)

    def segment(
        self, points: Any, *, progress: Progress | None = None, **parameters: Unpack[Keywords]
    ) -> Segmentation:
        """Finds the surfaces in a cloud, as a job of the service: as `conicoid.segment` does in this process.

        `points` may be all that it takes there; a file is sent as it is. Ctrl+C, or an exception from `progress`, cancels
        the job. The service keeps it for a while (its setting): `save`, `deviations` and `to_pandas` fetch from it.
        """
        job = self.submit(points, **parameters)
        try:
            return job.result(progress=progress)
        except BaseException as error:
            if not isinstance(error, Error):
                job.cancel()
            raise

    def submit(self, points: Any, **parameters: Unpack[Keywords]) -> Job:
        """Sends a cloud and returns at once, with the job that it became."""
        options = named(points, parameters)
        body, media_type, original = body_of(points)
        # a request that is sent again is the same job
        headers = {
            "content-type": media_type,
            "content-length": str(body.length),
            "idempotency-key": uuid.uuid4().hex,
            "prefer": "respond-async",
        }
        target = f"/v1/segmentations?{urlencode(options)}"
        document = self._transport.json("POST", target, headers, body.chunks)
        return Job(self, document, original, options.get("labels") != "none")

    def fit(self, points: Any, **parameters: Unpack[FitKeywords]) -> FitDocument:
        """Fits one feature to all points, as `conicoid.fit` does in this process."""
        body, media_type, _ = body_of(points)
        options = named(points, parameters)
        headers = {"content-type": media_type, "content-length": str(body.length)}
        target = f"/v1/fits?{urlencode(options)}"
        return FitDocument(self._transport.json("POST", target, headers, body.chunks))

    def job(self, id: str) -> Job:
        """The job of that id, which this key submitted."""
        document = self._transport.json("GET", f"/v1/jobs/{quote(id, safe='')}")
        return Job(self, document, None, True)

    def __repr__(self) -> str:
        return f"Client({self._transport.url!r})"


class Job:
    """A cloud that a service works on."""

    def __init__(
        self, client: Client, document: dict[str, Any], original: Any, has_labels: bool
    ) -> None:
        self._transport = client._transport
        self._document = document
        self._original = original
        self._has_labels = has_labels

    @property
    def id(self) -> str:
        """Its id, for `Client.job`."""
        return str(self._document["id"])

    @property
    def state(self) -> str:
        """``queued``, ``running``, ``succeeded``, ``failed`` or ``cancelled``, as last heard of."""
        return str(self._document["state"])

    @property
    def progress(self) -> tuple[str, float] | None:
        """The stage and the fraction of the work that is done, as last heard of; None while it does not run."""
        told = self._document.get("progress")
        return (told["stage"], told["fraction"]) if told else None

    @property
    def path(self) -> str:
        """Where it is at the service."""
        return f"/v1/jobs/{self.id}"

    def refresh(self) -> Job:
        """Asks the service where it stands."""
        self._document = self._transport.json("GET", self.path)
        return self

    def wait(self, *, timeout: float | None = None, progress: Progress | None = None) -> Job:
        """Waits until it has ended, well or not.

        Raises
        ------
        TimeoutError
            It has not after `timeout` seconds; it goes on.
        """
        end = None if timeout is None else time.monotonic() + timeout
        told: tuple[str, float] | None = None
        for document in self._transport.events(f"{self.path}/events", end):
            self._document = document
            if progress and self.progress and self.progress != told:
                told = self.progress
                progress(*told)
        if progress and self.state == "succeeded" and (told is None or told[1] < 1.0):
            progress("report", 1.0)
        return self

    def result(
        self, *, timeout: float | None = None, progress: Progress | None = None
    ) -> Segmentation:
        """Waits until it has ended, and returns what was found.

        Raises
        ------
        Error
            It failed, of the kind that `conicoid.segment` raises; or somebody cancelled it.
        TimeoutError
            It has not ended after `timeout` seconds; it goes on.
        """
        self.wait(timeout=timeout, progress=progress)
        if self.state == "cancelled":
            raise Cancelled("cancelled", f"the job {self.id} was cancelled")
        problem = self._document.get("problem")
        if self.state == "failed" or problem:
            problem = problem or {"code": "job_failed", "detail": f"the job {self.id} failed"}
            raise of_code(problem["code"], problem["detail"])
        return Segmentation(_Remote(self, self._original, self._has_labels))

    def cancel(self) -> None:
        """Cancels it where it has not ended, else forgets it with its result."""
        self._document = self._transport.json("DELETE", self.path)

    def __repr__(self) -> str:
        return f"<Job {self.id}: {self.state}>"


class _Remote:
    """An answer that a service keeps with its job."""

    def __init__(self, job: Job, original: Any, has_labels: bool) -> None:
        self._job = job
        self._original = original
        self._document = self._get("application/json", "?labels=none")
        self._has_labels = has_labels
        # what everybody asks for is fetched while the job is surely there
        self._labels: npt.NDArray[np.int32] = self._array("npy")

    def _get(self, media_type: str, query: str = "") -> bytes:
        job = self._job
        return job._transport.bytes("GET", f"{job.path}/result{query}", {"accept": media_type})

    def _array(self, ending: str) -> npt.NDArray[Any]:
        array: npt.NDArray[Any] = np.load(io.BytesIO(self._get(_MEDIA_TYPES[ending])))
        return array

    @property
    def has_labels(self) -> bool:
        return self._has_labels

    def document(self) -> bytes:
        return self._document

    def labels(self) -> npt.NDArray[np.int32]:
        return self._labels

    def face_labels(self) -> npt.NDArray[np.int32]:
        return np.array(json.loads(self._get("application/json"))["face_labels"], np.int32)

    def deviations(self) -> npt.NDArray[np.float64]:
        return self._array("deviations.npy")

    def points(self) -> npt.NDArray[np.float64]:
        if self._original is None:
            return np.array(read_cloud(self._get("model/ply")).points)
        if isinstance(self._original, (str, os.PathLike)):
            return np.array(read_cloud(self._original).points)
        points = np.array(self._original, dtype=np.float64)
        points[~np.isfinite(points).all(axis=1)] = np.nan
        return points

    def write(self, ending: str, labels: bool) -> bytes:
        query = f"?labels={'inline' if labels else 'none'}" if ending == "json" else ""
        return self._get(_MEDIA_TYPES[ending], query)
