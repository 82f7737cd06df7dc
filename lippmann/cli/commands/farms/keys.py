"""Keys: create, list and revoke them, links that log a browser in, and the audit log."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from lippmann.cli.options import DATA_DIR, DataDir, finite, with_context
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.terminal.output import Output

app = typer.Typer(help="Manage the keys to the service. Most commands need an admin key.", no_args_is_help=True)


@app.command()
@with_context
def create(
    name: Annotated[str, typer.Argument(help="The name of the key: its owner or its purpose.")],
    role: Annotated[Literal["viewer", "submitter", "admin"], typer.Option(help="The role of the key.")] = "submitter",
    owner: Annotated[
        str | None,
        typer.Option(
            help="The owner of the key's jobs and scenes: a name, or the id of an earlier key of the user. "
            "Keys with the same owner change each other's jobs. By default each key is its own owner."
        ),
    ] = None,
    days: Annotated[
        float | None,
        typer.Option(min=0.0, callback=finite, help="The days until the key expires. By default it does not expire."),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=NUMBER", help="A limit of the key, such as `open_jobs=10`; it may be repeated."),
    ] = None,
    worker: Annotated[
        bool,
        typer.Option(
            "--worker", help="Make a worker key instead, and write a file with which a machine joins the farm."
        ),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The join file of a worker key. It must not exist.")
    ] = None,
    pool: Annotated[str, typer.Option(help="The pool of the worker, if it is in one.")] = "",
    tag: Annotated[list[str] | None, typer.Option(help="A tag of the worker; it may be repeated.")] = None,
    redis_url: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="The broker in the join file, and your user for workers, if not as the service has them.",
        ),
    ] = None,
    redis_password_file: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The password of that user; the key then gets none of its own.")
    ] = None,
    s3_endpoint: Annotated[
        str | None, typer.Option(metavar="URL", help="The S3 server in the join file, if not as the service has it.")
    ] = None,
    s3_access_key_file: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The access keys for it, in a file as AWS has it.")
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Create a key. It is shown only once. With --worker, it is written to a file."""
    given = {
        "redis_url": redis_url, "password_file": redis_password_file, "s3_endpoint": s3_endpoint,
        "access_key_file": s3_access_key_file,
    }  # fmt: skip
    if worker:
        if owner is not None or limit or role != "submitter":
            raise BadInput(
                "--worker: expected no --role, --owner and --limit, since a worker key opens nothing in the API"
            )
        if out is None:
            raise BadInput("--worker: expected --out FILE for the join file, got none")
        _create_worker_key(
            name, out, {"expires_in_days": days, "pool": pool, "tags": tag or ()}, given, output, connection
        )
        return
    if out is not None or pool or tag or any(value is not None for value in given.values()):
        raise BadInput("expected --worker beside --out, --pool, --tag, --redis-... and --s3-..., got none")
    limits = dict(_limit(text) for text in limit or ())
    with connection.client() as client:
        made = client.create_key(name, role, owner_id=owner, expires_in_days=days, limits=limits or None)
    output.note(f"Key {made.id} ({made.role}) of {made.name}. Keep it, because it is not shown again:")
    output.result(made.model_dump(mode="json"), made.key)


def _create_worker_key(
    name: str, out: Path, wanted: dict[str, Any], given: dict[str, Any], output: Output, connection: Connection
) -> None:
    from lippmann.farm.joining import complete, notes_on
    from lippmann.join_file import check_absent, write_join_file

    check_absent(out)
    with connection.client() as client:
        made = client.create_worker_key(
            name, **wanted, broker_user="own" if given["password_file"] is None else "given"
        )
        try:
            join = complete(made.join, **given)
            write_join_file(out, join)
        except BaseException:
            client.revoke_key(made.id)  # Nobody has it.
            raise
    for note in notes_on(join, is_of_service=not made.has_broker_user and given["password_file"] is None):
        output.note(f"note: {note}")
    output.note(f"Worker key {made.id} of {made.name}. On the other machine: lippmann worker --join {out.name}")
    data = made.model_dump(mode="json", exclude={"join"}) | {"file": str(out)}
    output.result(data, str(out))


@app.command()
@with_context
def admin(
    name: Annotated[str, typer.Argument(help="The name of the key.")] = "admin",
    data_dir: DataDir = DATA_DIR,
    *,
    output: Output,
) -> None:
    """Create an admin key in the database itself.

    It is the first key of a farm, or one in place of a lost one. It needs no key and no service that answers, since
    whoever can write the database is an administrator already. LIPPMANN_DATABASE_URL names the database if it is not in
    the data folder.
    """
    import time

    from pydantic import ValidationError

    from service.audit import record
    from service.auth import Caller, create_key
    from service.db.engine import opened
    from service.db.tables import ADMIN_OWNER
    from service.schemas.access import AuditAction, KeyRequest, Role
    from service.settings import Settings

    try:
        wanted = KeyRequest(name=name, role=Role.ADMIN)
    except ValidationError:
        raise BadInput(f"NAME: expected 1 to 64 characters in one line, got {name!r}") from None
    with opened(Settings(data_dir=data_dir).database) as database, database.writing() as session:
        now_s = time.time()
        key_id, key = create_key(session, wanted.name, Role.ADMIN, owner_id=ADMIN_OWNER, now_s=now_s)
        caller = Caller(id="", key_id="", name="lippmann keys admin", role=Role.ADMIN, owner_id=ADMIN_OWNER)
        record(session, caller, AuditAction.CREATE_KEY, key_id, now_s=now_s, detail=f"name {wanted.name}, role admin")
    output.note(f"Key {key_id} (admin) of {wanted.name}. Keep it, because it is not shown again:")
    output.result({"id": key_id, "name": wanted.name, "role": "admin", "key": key}, key)


def _limit(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"--limit: expected NAME=NUMBER, such as open_jobs=10, got {text!r}")
    return name, int(number) if number.is_integer() else number


@app.command("list")
@with_context
def list_keys(output: Output, connection: Connection) -> None:
    """List the keys without their secrets."""
    from lippmann.cli.text.access import key_table

    with connection.client() as client:
        found, workers = client.keys(), client.worker_keys()
    data = [one.model_dump(mode="json") for one in found]
    data += [one.model_dump(mode="json") | {"role": "worker"} for one in workers]
    output.result(data, key_table(found, workers))


@app.command()
@with_context
def revoke(
    key_id: Annotated[str, typer.Argument(help="The id of the key, as `keys list` shows it.")],
    output: Output,
    connection: Connection,
) -> None:
    """Revoke a key. The browser sessions that it opened and their event streams end at once.

    The workers that joined with a worker key end, and their tasks go to others.
    """
    with connection.client() as client:
        client.revoke_key(key_id)
    output.result({"id": key_id, "revoked": True}, f"Key {key_id} is revoked.")


@app.command()
@with_context
def link(output: Output, connection: Connection) -> None:
    """Create a link that logs a browser in once."""
    with connection.client() as client:
        made = client.login_link()
    output.result(made.model_dump(mode="json"), made.url)


@app.command()
@with_context
def usage(output: Output, connection: Connection) -> None:
    """Show what you use of the farm, and your limits. Every key may ask."""
    from lippmann.cli.text.access import usage_table

    with connection.client() as client:
        found = client.usage()
    output.result(found.model_dump(mode="json"), usage_table(found))


@app.command("webhook-secret")
@with_context
def webhook_secret(output: Output, connection: Connection) -> None:
    """Show the secret that verifies the webhooks of your jobs. A key of a submitter is enough."""
    with connection.client() as client:
        found = client.webhook_secret()
    output.result(found.model_dump(mode="json"), found.secret)


@app.command()
@with_context
def audit(
    limit: Annotated[int, typer.Option(min=1, help="The largest number of changes to list.")] = 50,
    action: Annotated[str | None, typer.Option(help="Only changes of this kind, such as `remove-job`.")] = None,
    by: Annotated[
        str | None, typer.Option(metavar="KEY", help="Only changes by keys with this name or this id.")
    ] = None,
    subject: Annotated[str | None, typer.Option(help="Only changes of this job, task, scene, key or worker.")] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the latest changes: who made which, when, from where."""
    from lippmann.cli.text.access import audit_table

    with connection.client() as client:
        found = list(client.audit(limit=limit, action=action, name=by, subject=subject))
    output.result([one.model_dump(mode="json") for one in found], audit_table(found))
