"""Errors of an S3 server, translated: what is missing, what is full, and what is unavailable and why.

The messages name the setting that is probably wrong, and never a key.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

from botocore.exceptions import (
    BotoCoreError,
    ClientError,
    ConnectTimeoutError,
    EndpointConnectionError,
    HTTPClientError,
    NoCredentialsError,
    PartialCredentialsError,
    ReadTimeoutError,
)

from lippmann.errors import ArtifactMissing, LippmannError, StoreFull, StoreUnavailable

_MISSING = frozenset({"404", "NoSuchKey", "NotFound"})
_FULL = frozenset({"507", "InsufficientStorage", "QuotaExceeded", "XMinioStorageFull", "EntityTooLarge"})
_REASONS = {
    "NoSuchBucket": "the server has no bucket of this name",
    "InvalidBucketName": "this is not the name of a bucket",
    "InvalidAccessKeyId": "the server does not know the access key",
    "SignatureDoesNotMatch": "the secret key is not that of the access key",
    "AuthorizationHeaderMalformed": "the region is not that of the bucket",
    "PermanentRedirect": "the bucket is in another region",
    "AccessDenied": "the access key has no right to do this",
    "403": "the access key is unknown, or has no right to do this",
    "ExpiredToken": "the access key has expired",
    "SlowDown": "the server asks for fewer requests",
    "ServiceUnavailable": "the server is unavailable",
}
SKEWED = "RequestTimeTooSkewed"


def code_of(error: ClientError) -> str:
    """Return the code of an error that a server answered with, such as `NoSuchKey`."""
    return str(error.response.get("Error", {}).get("Code", ""))


@contextmanager
def translated(what: str, place: str) -> Iterator[None]:
    """Translate the errors of botocore.

    Parameters
    ----------
    what
        What is read or written, for the message.
    place
        The bucket and the server, for the message.

    Raises
    ------
    ArtifactMissing, StoreFull, StoreUnavailable
        According to the answer of the server, or to its silence.
    """
    try:
        yield
    except ClientError as error:
        raise _of_answer(error, what, place) from error
    except (BotoCoreError, HTTPClientError) as error:
        raise StoreUnavailable(f"cannot reach {what} in the store: {place}: {_of_silence(error)}") from error


def _of_answer(error: ClientError, what: str, place: str) -> LippmannError:
    code = code_of(error)
    if code in _MISSING:
        return ArtifactMissing(f"expected the artifact {what}, got nothing there")
    if code in _FULL:
        return StoreFull(f"no room for {what}: {place} is full")
    if code == SKEWED:
        reason = f"the clock of this machine differs from that of the server{_skew(error.response)}"
    else:
        reason = _REASONS.get(code) or f"the server answers {code or 'an error'}"
    return StoreUnavailable(f"cannot reach {what} in the store: {place}: {reason}")


def _skew(response: Any) -> str:
    stamp = response.get("ResponseMetadata", {}).get("HTTPHeaders", {}).get("date")
    try:
        seconds = (datetime.now(UTC) - parsedate_to_datetime(stamp)).total_seconds()
    except (TypeError, ValueError):
        return ""
    return f" by {seconds:+.0f} s"


def _of_silence(error: Exception) -> str:
    match error:
        case NoCredentialsError() | PartialCredentialsError():
            return "there is no access key; give AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or a file of them"
        case EndpointConnectionError() | ConnectTimeoutError():
            return "the server does not answer"
        case ReadTimeoutError():
            return "the server does not answer in time"
        case _:
            return f"the connection failed ({type(error).__name__})"
