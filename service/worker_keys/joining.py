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
from service.audit import record
from service.auth import Caller, create_credential
from service.db import access as access_rows
from service.db.engine import Database
from service.db.tables import CredentialKind
from service.errors import BrokerUnavailable
from service.schemas.access import AuditAction, Role
from service.schemas.answer import utc_or_none
from service.schemas.worker_keys import WorkerKeyRequest
from service.settings import Settings
from service.worker_keys.broker_users import BrokerUsers, user_of

MAX_CERTIFICATES_BYTES = 500_000


def create_worker_key(
    session: Session, wanted: WorkerKeyRequest, *, settings: Settings, expires_s: float | None, now_s: float
) -> JoinFile:
    """Create a worker key, and return its join file. A user of its own at the broker is made later, by `make_user`.

    Raises
    ------
    BadInput
        If the settings of the service do not say how another machine reaches broker or store.
    """
    _check_reachable(settings)
    row, secret = create_credential(
        session, CredentialKind.WORKER, wanted.name, Role.VIEWER, expires_s=expires_s, now_s=now_s
    )  # fmt: skip
    row.has_broker_user = wanted.broker_user == "own"
    session.flush()
    broker = _broker(settings)
    if not row.has_broker_user:
        broker = broker.model_copy(update={"user": "", "password": ""})
    order_keys = settings.order_keys.keys()
    return JoinFile(
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


def make_user(
    database: Database, users: BrokerUsers, join: JoinFile, *, caller: Caller, now_s: float
) -> tuple[JoinFile, bool]:
    """Make the user of a new key at the broker, which may take seconds and therefore is no part of a transaction.

    Returns
    -------
    JoinFile, bool
        The join file with this user and True; or as it was, with the password of the service, and False, if the
        service may not make users and has no user of its own there.

    Raises
    ------
    BadInput, BrokerUnavailable
        If the user could not be made. Then the key is revoked.
    """
    key = WorkerKey.of_secret(join.worker.id, join.worker.secret)
    try:
        is_made = users.make(key)
        if not is_made and join.broker.user:
            raise BadInput(
                "broker_user: the service may not make users at the broker (its user lacks `+acl|setuser +acl|deluser "
                "+acl|users`); give the user for workers with --redis-url and --redis-password-file"
            )
    except (BadInput, BrokerUnavailable) as error:
        with database.writing() as session:
            if isinstance(error, BadInput):  # Otherwise the user may exist all the same, and is deleted later.
                access_rows.forget_broker_user(session, key.id)
            revoke_worker_key(session, key.id, now_s=now_s)
            detail = "its user at the broker was not made"
            record(session, caller, AuditAction.REVOKE_KEY, key.id, now_s=now_s, detail=detail)
        raise
    if not is_made:
        with database.writing() as session:
            access_rows.forget_broker_user(session, key.id)
        return join, False
    own = {"user": user_of(key.id), "password": key.broker_password}
    return join.model_copy(update={"broker": join.broker.model_copy(update=own)}), True


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
        user="" if (user := unquote(parts.username or "")) == "default" else user,
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
