"""What can go wrong: the same codes in process and from the service."""

from __future__ import annotations

__all__ = [
    "Cancelled",
    "CloudError",
    "ConnectionFailed",
    "DeadlineExceeded",
    "Error",
    "JobFailed",
    "ParameterError",
    "ServiceError",
    "UnknownParameterError",
]


class Error(Exception):
    """Something went wrong; every exception of this package is one.

    ``str()`` of it says what happened, with the offending value, and what to do.
    """

    #: The stable code, such as ``too_few_points``.
    code: str
    #: What happened and what to do.
    detail: str
    #: The HTTP status, where a service answered.
    status: int | None
    #: The request's id in the service's log, where a service answered.
    request_id: str | None

    def __init__(
        self, code: str, detail: str, status: int | None = None, request_id: str | None = None
    ) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.status = status
        self.request_id = request_id

    def __str__(self) -> str:
        return self.detail

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.code, self.detail, self.status, self.request_id))


class ParameterError(Error, ValueError):
    """A parameter's value is not one that it takes."""


class UnknownParameterError(Error, TypeError):
    """No parameter has this name."""


class CloudError(Error, ValueError):
    """The cloud cannot be read, or cannot be worked with."""


class DeadlineExceeded(Error, TimeoutError):
    """The work took longer than the parameter ``deadline``."""


class Cancelled(Error):
    """Somebody cancelled the work."""


class ServiceError(Error):
    """The service does not do what was asked: no valid key, too much work at hand, a fault."""


class JobFailed(ServiceError):
    """A job ended without a result for a reason of the service's."""


class ConnectionFailed(ServiceError, ConnectionError):
    """The service cannot be reached, or the connection broke."""


_OF_CODE: dict[str, type[Error]] = {
    "unknown_parameter": UnknownParameterError,
    "invalid_parameter": ParameterError,
    "not_acceptable": ParameterError,
    "empty_body": CloudError,
    "malformed_body": CloudError,
    "malformed_cloud": CloudError,
    "no_finite_points": CloudError,
    "not_determined": CloudError,
    "too_few_points": CloudError,
    "too_many_points": CloudError,
    "extent_out_of_range": CloudError,
    "unknown_format": CloudError,
    "body_too_large": CloudError,
    "deadline_exceeded": DeadlineExceeded,
    "cancelled": Cancelled,
    "connection_failed": ConnectionFailed,
    "job_failed": JobFailed,
}


def of_code(
    code: str, detail: str, status: int | None = None, request_id: str | None = None
) -> Error:
    """The exception for a code of the table of errors."""
    known = _OF_CODE.get(code, Error if status is None else ServiceError)
    return known(code, detail, status, request_id)
