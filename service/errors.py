"""The errors of the service, and the table of error codes and HTTP statuses.

The docstring of a class is its default message. The table also covers the errors of `lippmann.errors` that reach a
request.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import MappingProxyType

from lippmann.errors import FieldProblem, InvalidText, LippmannError, SpecError

STATUS_OF_CODE = MappingProxyType(
    {
        "bad-request": 400,
        "unauthorized": 401,
        "forbidden": 403,
        "not-found": 404,
        "artifact-missing": 404,
        "method-not-allowed": 405,
        "not-acceptable": 406,
        "move-not-allowed": 409,
        "scene-builtin": 409,
        "job-not-ended": 409,
        "too-large": 413,
        "too-many-requests": 429,
        "quota": 429,
        "storage-quota": 403,
        "range-not-satisfiable": 416,
        "invalid": 422,
        "bad-input": 422,
        "spec": 422,
        "optics": 422,
        "layout": 422,
        "bundle": 422,
        "scene": 422,
        "idempotency-mismatch": 422,
        "internal": 500,
        "artifact-broken": 500,
        "artifact-repairing": 503,
        "picture-failed": 503,
        "preview-failed": 503,
        "preview-unavailable": 503,
        "preview-replaced": 409,
        "broker-unavailable": 503,
        "database-unavailable": 503,
        "provider-unavailable": 503,
        "store-unavailable": 503,
        "store-full": 507,
    }
)
"""The HTTP status for each error code. A code that is not listed is an internal error: 500."""


class ServiceError(Exception):
    """The service failed."""

    code = "internal"

    def __init__(self, message: str | None = None, *, problems: Iterable[FieldProblem] = ()) -> None:
        super().__init__(message or (type(self).__doc__ or "").strip())
        self.problems = tuple(problems)

    @property
    def message(self) -> str:
        """The sentence a user reads."""
        return str(self.args[0])


class Unauthorized(ServiceError):
    """A key is required: send `Authorization: Bearer <key>` or log in."""

    code = "unauthorized"


class Forbidden(ServiceError):
    """The role of the key does not allow this."""

    code = "forbidden"


class NotFound(ServiceError):
    """The requested item does not exist."""

    code = "not-found"


class TransitionNotAllowed(ServiceError):
    """The action is not allowed in the present status of the job."""

    code = "move-not-allowed"


class JobNotEnded(ServiceError):
    """The job has not ended; cancel it first."""

    code = "job-not-ended"


class SceneBuiltin(ServiceError):
    """The name belongs to a built-in scene."""

    code = "scene-builtin"


class TooLarge(ServiceError):
    """The request is too large."""

    code = "too-large"


class TooManyRequests(ServiceError):
    """There are too many requests; try again later."""

    code = "too-many-requests"

    def __init__(self, message: str | None = None, *, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class QuotaExceeded(TooManyRequests):
    """The owner has as many open jobs as the farm or the key allows."""

    code = "quota"


class StorageQuotaExceeded(ServiceError):
    """The owner has stored as much as the farm or the key allows."""

    code = "storage-quota"


class RangeNotSatisfiable(ServiceError):
    """The range lies outside the file."""

    code = "range-not-satisfiable"

    def __init__(self, size: int) -> None:
        super().__init__(f"expected a range within {size} bytes")
        self.size = size


class Invalid(ServiceError):
    """A field is invalid."""

    code = "invalid"


class IdempotencyMismatch(ServiceError):
    """The Idempotency-Key was used with another job file."""

    code = "idempotency-mismatch"


class ArtifactRepairing(ServiceError):
    """The artifact is damaged, and the farm makes it again."""

    code = "artifact-repairing"


class PictureFailed(ServiceError):
    """The picture could not be made; try again."""

    code = "picture-failed"


class PreviewFailed(ServiceError):
    """The preview could not be rendered; try again."""

    code = "preview-failed"


class PreviewUnavailable(ServiceError):
    """No worker renders previews of this job now."""

    code = "preview-unavailable"


class PreviewReplaced(ServiceError):
    """A newer preview of the same series was asked for."""

    code = "preview-replaced"


class DatabaseUnavailable(ServiceError):
    """The database does not answer."""

    code = "database-unavailable"


class ProviderUnavailable(ServiceError):
    """The OpenID provider does not answer; log in with a key, or try again."""

    code = "provider-unavailable"


class BrokerUnavailable(ServiceError):
    """The broker does not answer."""

    code = "broker-unavailable"


class NotLeading(ServiceError):
    """Another process leads."""

    code = "not-leading"


def status_of(code: str) -> int:
    """Return the HTTP status for an error code."""
    return STATUS_OF_CODE.get(code, 500)


def problems_in(error: ServiceError | LippmannError) -> tuple[FieldProblem, ...]:
    """Return the fields at fault that an error names."""
    return error.problems if isinstance(error, ServiceError | SpecError | InvalidText) else ()
