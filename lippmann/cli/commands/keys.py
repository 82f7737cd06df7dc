"""Keys: create, list and revoke them, links that log a browser in, and the audit log."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from lippmann.cli.options import with_context
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
        float | None, typer.Option(min=0.0, help="The days until the key expires. By default it does not expire.")
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=NUMBER", help="A limit of the key, such as `open_jobs=10`; it may be repeated."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Create a key. It is shown only once."""
    limits = dict(_limit(text) for text in limit or ())
    with connection.client() as client:
        made = client.create_key(name, role, owner_id=owner, expires_in_days=days, limits=limits or None)
    output.note(f"Key {made.id} ({made.role}) of {made.name}. Keep it, because it is not shown again:")
    output.result(made.model_dump(mode="json"), made.key)


def _limit(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        raise BadInput(f"--limit: expected NAME=NUMBER, such as open_jobs=10, got {text!r}") from None
    return name, int(number) if number.is_integer() else number


@app.command("list")
@with_context
def list_keys(output: Output, connection: Connection) -> None:
    """List the keys without their secrets."""
    from lippmann.cli.text.access import key_table

    with connection.client() as client:
        found = client.keys()
    output.result([one.model_dump(mode="json") for one in found], key_table(found))


@app.command()
@with_context
def revoke(
    key_id: Annotated[str, typer.Argument(help="The id of the key, as `keys list` shows it.")],
    output: Output,
    connection: Connection,
) -> None:
    """Revoke a key. The browser sessions that it opened and their event streams end at once."""
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
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the latest changes: who made which, when, from where."""
    from lippmann.cli.text.access import audit_table

    with connection.client() as client:
        found = list(client.audit(limit=limit))
    output.result([one.model_dump(mode="json") for one in found], audit_table(found))
