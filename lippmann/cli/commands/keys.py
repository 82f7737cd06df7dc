"""Keys: create, list and revoke them, and links that log a browser in."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from lippmann.cli.options import with_context
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

app = typer.Typer(help="Manage the keys to the service. An admin key is needed.", no_args_is_help=True)


@app.command()
@with_context
def create(
    name: Annotated[str, typer.Argument(help="The name of the key: its owner or its purpose.")],
    role: Annotated[Literal["viewer", "submitter", "admin"], typer.Option(help="The role of the key.")] = "submitter",
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Create a key. It is shown only once."""
    with connection.client() as client:
        made = client.create_key(name, role)
    output.note(f"Key {made.id} ({made.role}) of {made.name}. Keep it, because it is not shown again:")
    output.result(made.model_dump(mode="json"), made.key)


@app.command("list")
@with_context
def list_keys(output: Output, connection: Connection) -> None:
    """List the keys without their secrets."""
    from lippmann.cli.text.jobs import key_table

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
    """Revoke a key and the browser sessions that it opened."""
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
