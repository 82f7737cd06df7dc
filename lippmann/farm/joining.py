"""Joining a farm by a join file: its settings become those of a worker, and its secrets become private files."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from urllib.parse import unquote, urlsplit, urlunsplit

from pydantic import ValidationError

from lippmann.errors import BadInput
from lippmann.join_file import JoinFile, read_access_keys
from lippmann.key_file import read_secret

FOLDER = "join"
"""The folder in the data folder of the worker with a folder of secrets for each worker key. Each start writes it."""
OWN_KEYS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN", "AWS_PROFILE", "AWS_DEFAULT_PROFILE")
"""The variables that would take precedence over the access keys of the join file."""


def join_farm(join: JoinFile, data_dir: Path, environment: MutableMapping[str, str]) -> list[str]:
    """Write the secrets of a join file into the data folder, and put the settings that it has into the environment.

    Returns
    -------
    list[str]
        The variables that had another value, which counts no more.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    given = {
        **_settings(join),
        **{name: str(path) for name, path in _secrets(join, data_dir / FOLDER / join.worker.id).items()},
    }
    removed = [name for name in OWN_KEYS if join.store.access_key and name in environment]
    removed += [name for name in _ABSENT if name not in given and environment.get(name)]
    changed = [name for name, value in given.items() if environment.get(name, value) != value]
    for name in removed:
        del environment[name]
    environment.update(given)
    return sorted([*removed, *changed])


def complete(
    join: JoinFile, *, redis_url: str | None, password_file: Path | None, s3_endpoint: str | None,
    access_key_file: Path | None,
) -> JoinFile:  # fmt: skip
    """Return a join file with the addresses and secrets that were given in place of those of the service.

    Raises
    ------
    BadInput
        If a file cannot be read, or a value is invalid.
    """
    broker, store = join.broker.model_dump(), join.store.model_dump()
    if redis_url is not None:
        parts = urlsplit(redis_url)
        broker["url"] = urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))
        if parts.password:
            raise BadInput("--redis-url: expected a URL without a password, which --redis-password-file names")
        broker["user"] = unquote(parts.username or "") or broker["user"]
    if password_file is not None:
        broker["password"] = read_secret(password_file)
    if s3_endpoint is not None:
        store["endpoint"] = s3_endpoint
    if access_key_file is not None:
        store["access_key"], store["secret_key"] = read_access_keys(access_key_file)
    try:
        return JoinFile.model_validate(join.model_dump() | {"broker": broker, "store": store})
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        field = ".".join(map(str, first["loc"]))
        raise BadInput(f"{field}: {first['msg'].removeprefix('Value error, ')}") from None


def notes_on(join: JoinFile, *, is_of_service: bool = False) -> Iterator[str]:
    """Yield what a person should know of a join file before another machine uses it.

    Parameters
    ----------
    is_of_service
        True if user and password at the broker are those of the service.
    """
    if is_of_service and join.broker.password:
        yield (
            "the file has the password of the service itself at the broker, which a revocation of the key does not "
            "shut out; give one of a user for workers with --redis-url and --redis-password-file"
        )
    host = urlsplit(join.broker.url).hostname
    if host in ("localhost", "127.0.0.1", "::1"):
        yield f"the broker is {host}, which other machines do not reach; --redis-url names it as they do"
    elif join.broker.url.startswith("redis://"):
        yield "the way to the broker has no TLS, so whoever is on it reads the password; use rediss://"
    if not join.store.access_key:
        yield "the file has no access keys of the bucket; the machine needs its own, or --s3-access-key-file"


_ABSENT = ("LIPPMANN_REDIS_PASSWORD_FILE", "LIPPMANN_REDIS_CA_FILE", "LIPPMANN_S3_ENDPOINT", "LIPPMANN_S3_REGION")
"""The settings that a join file may leave out. What the environment says of another farm would then be wrong."""


def _settings(join: JoinFile) -> dict[str, str]:
    found = {"LIPPMANN_REDIS_URL": _broker_url(join), "LIPPMANN_STORE_URL": join.store.url}
    optional = {"LIPPMANN_S3_ENDPOINT": join.store.endpoint, "LIPPMANN_S3_REGION": join.store.region}
    optional |= {"LIPPMANN_WORKER_POOL": join.worker.pool, "LIPPMANN_WORKER_TAGS": ",".join(join.worker.tags)}
    if join.store.access_key:
        optional["AWS_EC2_METADATA_DISABLED"] = "true"  # The keys are known, and nobody else is asked for them.
    return found | {name: value for name, value in optional.items() if value}


def _broker_url(join: JoinFile) -> str:
    parts = urlsplit(join.broker.url)
    return urlunsplit(parts._replace(netloc=f"{join.broker.user}@{parts.netloc}" if join.broker.user else parts.netloc))


def _secrets(join: JoinFile, folder: Path) -> Mapping[str, Path]:
    """Write the files of secrets, and return their paths by the variables that name them."""
    keys = f"[default]\naws_access_key_id = {join.store.access_key}\naws_secret_access_key = {join.store.secret_key}\n"
    texts = {
        "LIPPMANN_WORKER_KEY_FILE": ("worker.key", f"{join.worker.id} {join.worker.secret}\n"),
        "LIPPMANN_ORDER_KEY_FILE": ("order.key", "".join(f"{key}\n" for key in join.order_keys)),
        "LIPPMANN_REDIS_PASSWORD_FILE": ("broker.password", join.broker.password),
        "LIPPMANN_REDIS_CA_FILE": ("broker-ca.pem", join.broker.ca),
        "AWS_SHARED_CREDENTIALS_FILE": ("s3-keys", keys if join.store.access_key else ""),
        "AWS_CA_BUNDLE": ("s3-ca.pem", join.store.ca),
    }
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for name, text in texts.values():
            if text:
                _replace(folder / name, text)
    except OSError as error:
        raise BadInput(f"expected a folder that can be written, got {folder}: {error.strerror}") from error
    return {variable: folder.absolute() / name for variable, (name, text) in texts.items() if text}


def _replace(path: Path, text: str) -> None:
    """Write a file that only this user may read. Another worker may read the one that it replaces meanwhile."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
