"""New worker keys, and the join files of them, which have the addresses and secrets that a worker needs."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from urllib.parse import unquote, urlsplit, urlunsplit

from sqlalchemy.orm import Session

from lippmann.errors import BadInput
from lippmann.job.messages.worker_keys import WorkerKey
from lippmann.join_file import JoinBroker, JoinFile, JoinKey, JoinStore, read_access_keys
from lippmann.key_file import read_secret
from service.auth import create_credential
from service.db import access as access_rows
from service.db.engine import Database
from service.db.tables import Credential, CredentialKind
from service.errors import BrokerUnavailable
from service.schemas.access import Role
from service.schemas.answer import utc_or_none
from service.schemas.worker_keys import WorkerKeyRequest
from service.settings import Settings
from service.worker_keys.broker_users import BrokerUsers, user_of

MAX_CERTIFICATES_BYTES = 500_000


def create_worker_key(
    session: Session, wanted: WorkerKeyRequest, *, settings: Settings, users: BrokerUsers, expires_s: float | None,
    now_s: float,
) -> tuple[Credential, JoinFile]:  # fmt: skip
    """Create a worker key, with a user of its own at the broker if wanted and possible; return its row and join file.

    Raises
    ------
    BadInput
        If the settings of the service do not say how another machine reaches broker or store.
    BrokerUnavailable
        If the broker does not answer.
    """
    _check_reachable(settings)
    row, secret = create_credential(
        session, CredentialKind.WORKER, wanted.name, Role.VIEWER, expires_s=expires_s, now_s=now_s
    )  # fmt: skip
    key = WorkerKey.of_secret(row.id, secret)
    broker = _broker(settings)
    if wanted.broker_user == "own" and users.make(key):
        row.has_broker_user = True
        broker = broker.model_copy(update={"user": user_of(key.id), "password": key.broker_password})
    elif wanted.broker_user == "given":
        broker = broker.model_copy(update={"user": "", "password": ""})
    elif broker.user:
        raise BadInput(
            "broker_user: the service may not make users at the broker (its user lacks `+acl|setuser +acl|deluser "
            "+acl|users`); give the user for workers with --redis-url and --redis-password-file"
        )
    session.flush()
    order_keys = settings.order_keys.keys()
    join = JoinFile(
        farm=settings.base_url,
        release=version("lippmann"),
        order_keys=tuple(one.hex() for one in order_keys),
        worker=JoinKey(
            id=row.id,
            secret=secret,
            name=wanted.name,
            expires_at=utc_or_none(expires_s),
            pool=wanted.pool,
            tags=wanted.tags,
        ),
        broker=broker,
        store=_store(settings, os.environ),
    )
    return row, join


def revoke_worker_key(session: Session, key_id: str, *, now_s: float) -> bool:
    """Revoke a worker key; return False if no worker key has this id."""
    is_revoked = access_rows.revoke_worker_key(session, key_id, now_s=now_s)
    access_rows.delete_revoked_worker_keys(session, ())
    return is_revoked


def end_connections(database: Database, users: BrokerUsers, *, now_s: float) -> None:
    """Delete the users of revoked keys at the broker now; while it does not answer, the coordinator tries again."""
    try:
        users.reconcile(database, now_s=now_s)
    except BrokerUnavailable:
        return


def _check_reachable(settings: Settings) -> None:
    if urlsplit(settings.redis_url).scheme not in ("redis", "rediss"):
        raise BadInput(
            "LIPPMANN_REDIS_URL: expected a broker that other machines reach, redis:// or rediss://, got a socket of "
            "this machine, as that of `lippmann up`"
        )
    if not settings.store_url:
        raise BadInput(
            "LIPPMANN_STORE_URL: expected a bucket, since a worker on another machine does not see the folder "
            f"{settings.data_dir}/artifacts, got none"
        )


def _broker(settings: Settings) -> JoinBroker:
    """Return the way to the broker as the service goes it, with its own user and password."""
    parts = urlsplit(settings.redis_url)
    if parts.query:
        raise BadInput("LIPPMANN_REDIS_URL: expected a URL without options for a join file, got some after '?'")
    file = settings.redis_password_file
    return JoinBroker(
        url=urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2])),
        user=unquote(parts.username or "").removeprefix("default"),
        password=read_secret(file) if file else unquote(parts.password or ""),
        ca=_certificates(settings.redis_ca_file),
    )


def _store(settings: Settings, environment: Mapping[str, str]) -> JoinStore:
    """Return the way to the store, with the access keys that the service itself has, unless they are temporary."""
    access_key, secret_key = _access_keys(environment)
    return JoinStore(
        url=settings.store_url, endpoint=settings.s3_endpoint,
        region=settings.s3_region or environment.get("AWS_DEFAULT_REGION", ""),
        access_key=access_key, secret_key=secret_key,
        ca=_certificates(Path(bundle) if (bundle := environment.get("AWS_CA_BUNDLE")) else None),
    )  # fmt: skip


def _access_keys(environment: Mapping[str, str]) -> tuple[str, str]:
    if environment.get("AWS_SESSION_TOKEN"):
        return "", ""
    if environment.get("AWS_ACCESS_KEY_ID"):
        return environment["AWS_ACCESS_KEY_ID"], environment.get("AWS_SECRET_ACCESS_KEY", "")
    if path := environment.get("AWS_SHARED_CREDENTIALS_FILE"):
        return read_access_keys(Path(path), profile=environment.get("AWS_PROFILE", "default"))
    return "", ""


def _certificates(path: Path | None) -> str:
    """Return the certificates in a file, which are no secret."""
    if path is None:
        return ""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")[:MAX_CERTIFICATES_BYTES]
    except OSError as error:
        raise BadInput(f"expected certificates that can be read, got {path}: {error.strerror}") from error
    blocks = re.findall(r"-----BEGIN CERTIFICATE-----.+?-----END CERTIFICATE-----", text, re.DOTALL)
    return "".join(f"{block}\n" for block in blocks)
