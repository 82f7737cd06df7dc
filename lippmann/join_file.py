"""The join file: everything that a worker on another machine needs, in one file of secrets.

It is TOML that only its user may read. `lippmann keys create NAME --worker --out FILE` writes it, and
`lippmann worker --join FILE` needs nothing else.
"""

from __future__ import annotations

import configparser
import json
import os
import re
import tomllib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from lippmann.broker_settings import ENDPOINT_URL, STORE_URL
from lippmann.errors import BadInput
from lippmann.job.messages.worker_keys import KEY_ID
from lippmann.job.rendering.workers import MAX_TAGS, Pool, Tag
from lippmann.key_file import KEY_BYTES, MAX_KEYS, private_bytes

MAX_JOIN_BYTES = 1_000_000
"""The limit of a join file; the certificates of a whole system have a quarter of it."""
HEAD = """\
# With this file, a machine joins a farm of Lippmann:  lippmann worker --join FILE
# Whoever has it can work for the farm. `lippmann keys revoke` with the id of the key ends that.
"""
_PEM = re.compile(r"\s*(-----BEGIN CERTIFICATE-----[A-Za-z0-9+/=\s]+-----END CERTIFICATE-----\s*)+")


def _check_broker(url: str) -> str:
    parts = urlsplit(url)
    if parts.scheme not in ("redis", "rediss") or not parts.hostname or "@" in parts.netloc or parts.query:
        raise ValueError("expected redis://HOST:PORT/0 or rediss://HOST:PORT/0, without user, password and options")
    return url


def _check_pem(text: str) -> str:
    if text and not _PEM.fullmatch(text):
        raise ValueError("expected certificates in PEM")
    return text


def _check_moment(moment: datetime) -> datetime:
    if moment.tzinfo is None:
        raise ValueError("expected a time with its zone, such as 2027-01-31T12:00:00Z")
    return moment


Line = Annotated[str, Field(max_length=1000, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""A text of one line, which may be empty."""
Certificates = Annotated[str, Field(max_length=MAX_JOIN_BYTES), AfterValidator(_check_pem)]
"""The certificates that sign the one of a server; if empty, those of the system count."""
Moment = Annotated[datetime, AfterValidator(_check_moment)]


class JoinPart(BaseModel):
    """A part of a join file."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class JoinKey(JoinPart):
    """The worker key of a join file."""

    id: Annotated[str, Field(pattern=rf"^{KEY_ID.pattern}$")]
    secret: Annotated[str, Field(min_length=32, max_length=200, pattern=r"^[A-Za-z0-9_-]+$")]
    name: Line
    expires_at: Moment | None = None
    """The time after which the farm refuses the key; null for a key that does not expire."""
    pool: Pool = ""
    """The pool of the worker; if empty, its own setting counts."""
    tags: Annotated[tuple[Tag, ...], Field(max_length=MAX_TAGS)] = ()
    """The tags of the worker; if there are none, its own setting counts."""


class JoinBroker(JoinPart):
    """The way to the broker."""

    url: Annotated[str, Field(max_length=1000), AfterValidator(_check_broker)]
    """Its URL without user and password."""
    user: Line = ""
    """The user at the broker; empty for the default user."""
    password: Line = ""
    """The password at the broker; empty for a broker without one."""
    ca: Certificates = ""


class JoinStore(JoinPart):
    """The way to the store of artifacts."""

    url: Annotated[str, Field(pattern=rf"^{STORE_URL.pattern}$")]
    """The bucket: `s3://bucket` or `s3://bucket/prefix`."""
    endpoint: Annotated[str, Field(pattern=rf"^({ENDPOINT_URL.pattern})?$")] = ""
    """The URL of the S3 server; if empty, Amazon's."""
    region: Line = ""
    access_key: Line = ""
    """The access key of the bucket; if empty, the machine of the worker must have a role or keys of its own."""
    secret_key: Line = ""
    ca: Certificates = ""


class JoinFile(JoinPart):
    """The content of a join file."""

    format: Literal[1] = 1
    farm: Line
    """The URL of the farm, for people; a worker does not call it."""
    release: Line
    """The release of the service that wrote the file."""
    order_keys: Annotated[
        tuple[Annotated[str, Field(pattern=rf"^[0-9a-f]{{{2 * KEY_BYTES}}}$")], ...],
        Field(min_length=1, max_length=MAX_KEYS),
    ]
    """The keys that sign orders and events, the signing one first."""
    worker: JoinKey
    broker: JoinBroker
    store: JoinStore


def join_text(join: JoinFile) -> str:
    """Return the text of a join file."""
    return HEAD + "\n".join(_lines(join.model_dump(mode="json", exclude_none=True))) + "\n"


def check_absent(path: Path) -> None:
    """Check that a file can be made, before a key is made for it.

    Raises
    ------
    BadInput
        If it exists, or its folder does not.
    """
    if os.path.lexists(path):
        raise BadInput(f"expected a file that does not exist yet, got {path}")
    if not path.absolute().parent.is_dir():
        raise BadInput(f"expected a file in a folder that exists, got {path}")


def write_join_file(path: Path, join: JoinFile) -> None:
    """Write a join file that only this user may read. A file that exists is never replaced.

    Raises
    ------
    BadInput
        If the file exists or cannot be written.
    """
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(join_text(join))
            file.flush()
            os.fsync(file.fileno())
    except FileExistsError:
        raise BadInput(f"expected a file that does not exist yet, got {path}") from None
    except OSError as error:
        raise BadInput(f"expected a file that can be written, got {path}: {error.strerror}") from error


def read_join_file(path: Path, *, now: datetime) -> JoinFile:
    """Read a join file, and check it.

    Raises
    ------
    BadInput
        If others may read the file, it is no join file, a field is invalid, or its key has expired.
    """
    data = private_bytes(path, what="join file", most_bytes=MAX_JOIN_BYTES)
    if len(data) > MAX_JOIN_BYTES:
        raise BadInput(f"{path}: expected a join file of at most {MAX_JOIN_BYTES} bytes, got more")
    try:
        found: dict[str, Any] = tomllib.loads(data.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise BadInput(f"{path}: expected a join file, which is TOML, got {error}") from error
    if found.get("format") != 1:
        raise BadInput(f"{path}: format: expected 1, the one that this release reads, got {found.get('format')!r}")
    try:
        join = JoinFile.model_validate(found)
    except ValidationError as error:
        # The value that was given is never repeated, because it may be a secret.
        first = error.errors(include_url=False, include_input=False)[0]
        field = ".".join(map(str, first["loc"]))
        raise BadInput(f"{path}: {field}: {first['msg'].removeprefix('Value error, ')}") from None
    if join.worker.expires_at is not None and join.worker.expires_at <= now:
        when = join.worker.expires_at.astimezone(UTC).isoformat(timespec="seconds")
        raise BadInput(
            f"{path}: worker.expires_at: the worker key {join.worker.id} expired at {when}; an admin makes another file"
        )
    return join


def read_access_keys(path: Path, *, profile: str = "default") -> tuple[str, str]:
    """Return the access key and the secret key in a file of the form that AWS_SHARED_CREDENTIALS_FILE has.

    Raises
    ------
    BadInput
        If others may read the file, or it has no such keys, or they are temporary.
    """
    parser = configparser.RawConfigParser()
    try:
        parser.read_string(private_bytes(path, what="file of access keys").decode())
        found = parser[profile]
        keys = found["aws_access_key_id"], found["aws_secret_access_key"]
    except (UnicodeDecodeError, configparser.Error, KeyError):
        raise BadInput(
            f"{path}: expected [{profile}] with aws_access_key_id and aws_secret_access_key, got another text"
        ) from None
    if "aws_session_token" in found:
        raise BadInput(f"{path}: expected access keys that stay valid, got temporary ones with a session token")
    return keys


def _lines(fields: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of a TOML document: first the single values, then a table for each part."""
    # A string of JSON is one of TOML too, as long as what is not ASCII stays as it is.
    for name, value in fields.items():
        if not isinstance(value, dict):
            yield f"{name} = {_value(value)}"
    for name, value in fields.items():
        if isinstance(value, dict):
            yield f"\n[{name}]"
            yield from _lines(value)


def _value(value: Any) -> str:
    if isinstance(value, str) and "\n" in value and "'''" not in value:
        return f"'''\n{value}'''"
    return json.dumps(value, ensure_ascii=False)
