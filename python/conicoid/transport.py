"""HTTP as the client needs it: the standard library, with errors as exceptions of this package."""

from __future__ import annotations

import json
import ssl
import time
from collections.abc import Callable, Iterator
from http.client import HTTPException, HTTPResponse
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import HTTPRedirectHandler, HTTPSHandler, Request, build_opener

from .errors import ConnectionFailed, Error, of_code

__all__ = ["Transport"]

Chunks = Callable[[], Iterator[bytes]]

#: States in which a job stays.
ENDED = ("succeeded", "failed", "cancelled")
#: Seconds between two tries to hear of a job where the connection broke.
PAUSE = 1.0


class _NoRedirects(HTTPRedirectHandler):
    """The service redirects nobody, and a key is for it alone."""

    def redirect_request(self, *_: Any) -> None:
        return None


class Transport:
    """Requests to one service."""

    def __init__(
        self,
        url: str,
        key: str | None,
        timeout: float,
        patience: float,
        context: ssl.SSLContext | None,
    ) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ValueError(f"the URL of a service begins with http:// or https://, not '{url}'")
        self.url = url.rstrip("/")
        self._key = key
        self._timeout = timeout
        self._patience = patience
        context = context or ssl.create_default_context()
        self._opener = build_opener(HTTPSHandler(context=context), _NoRedirects())

    def json(
        self,
        method: str,
        target: str,
        headers: dict[str, str] | None = None,
        chunks: Chunks | None = None,
    ) -> dict[str, Any]:
        """The JSON object that the service answers with."""
        body = self.bytes(method, target, headers, chunks)
        answer: dict[str, Any] = json.loads(body)
        return answer

    def bytes(
        self,
        method: str,
        target: str,
        headers: dict[str, str] | None = None,
        chunks: Chunks | None = None,
    ) -> bytes:
        """What the service answers with; asked again, for a while, where it has too much work at hand."""
        end = time.monotonic() + self._patience
        while True:
            try:
                with self._open(method, target, headers, chunks) as response:
                    return response.read()
            except Error as error:
                wait = _retry_after(error)
                if wait is None or time.monotonic() + wait > end:
                    raise
                time.sleep(wait)
            except (HTTPException, OSError) as error:
                raise self._broken(error) from error

    def events(self, target: str, end: float | None) -> Iterator[dict[str, Any]]:
        """Each state of a job until it has ended, `end` being a time of the monotonic clock."""
        failures = 0
        while True:
            try:
                for document in self._stream(target, end):
                    failures = 0
                    yield document
                    if document["state"] in ENDED:
                        return
            except (HTTPException, OSError, ConnectionFailed) as error:
                if end is not None and time.monotonic() >= end:
                    raise TimeoutError("the job has not ended in that time; it goes on") from None
                if isinstance(error, Error) and not isinstance(error, ConnectionFailed):
                    raise
                failures += 1
                if failures * PAUSE > self._patience:
                    raise self._broken(error) from error
                time.sleep(PAUSE)

    def _stream(self, target: str, end: float | None) -> Iterator[dict[str, Any]]:
        """The states that one connection tells."""
        left = self._timeout if end is None else max(min(self._timeout, end - time.monotonic()), 0.01)
        headers = {"accept": "text/event-stream"}
        with self._open("GET", target, headers, None, left) as response:
            for line in response:
                if end is not None and time.monotonic() >= end:
                    raise TimeoutError
                if line.startswith(b"data:"):
                    yield json.loads(line[5:])

    def _open(
        self,
        method: str,
        target: str,
        headers: dict[str, str] | None,
        chunks: Chunks | None,
        timeout: float | None = None,
    ) -> HTTPResponse:
        request = Request(self.url + target, chunks() if chunks else None, method=method)
        for name, value in (headers or {}).items():
            request.add_header(name, value)
        if self._key is not None:
            # it stays here where the service is asked by way of a proxy that redirects
            request.add_unredirected_header("Authorization", f"Bearer {self._key}")
        try:
            response: HTTPResponse = self._opener.open(request, timeout=timeout or self._timeout)
            return response
        except HTTPError as error:
            with error:
                raise _problem(error) from None
        except URLError as error:
            reason = error.reason
            raise reason if isinstance(reason, OSError) else self._broken(error) from error

    def _broken(self, error: Exception) -> Error:
        detail = f"the service at {self.url} cannot be reached, or went away: {error}"
        return ConnectionFailed("connection_failed", detail)


def _problem(error: HTTPError) -> Error:
    """The exception for a problem document (RFC 9457), or for what a proxy says in place of the service."""
    body = error.read()
    try:
        problem = json.loads(body)
        made = of_code(problem["code"], problem["detail"], error.code, problem.get("request_id"))
    except (ValueError, KeyError, TypeError):
        text = body[:200].decode(errors="replace")
        made = of_code("not_the_service", f"HTTP status {error.code}: {text}", error.code)
    wait = error.headers.get("retry-after", "")
    made.retry_after = float(wait) if wait.isdigit() else None  # type: ignore[attr-defined]
    return made


def _retry_after(error: Error) -> float | None:
    wait: float | None = getattr(error, "retry_after", None)
    return wait if error.status in (429, 503, 507) else None
