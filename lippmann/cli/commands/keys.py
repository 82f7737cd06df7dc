"""Keys: create, list, revoke; a link that logs a browser in."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Key, Url
from lippmann.client.connection import Connection
from lippmann.terminal.output import Talk

app = typer.Typer(help="Keys to the service, for admins.", no_args_is_help=True)


@app.command()
def create(
    name: Annotated[str, typer.Argument(help="Whose key, or what for.")],
    role: Annotated[Literal["viewer", "submitter", "admin"], typer.Option(help="What it may do.")] = "submitter",
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Make a key; it is shown this once."""
    with Connection(url, key, data_dir).client() as client:
        made = client.create_key(name, role)
    Talk(as_json).note(f"key {made.id} ({made.role}) of {made.name}; keep it, it is not shown again:")
    Talk(as_json).result(made.model_dump(mode="json"), made.key)


@app.command("list")
def list_keys(as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR) -> None:
    """List keys, without their secrets."""
    from lippmann.cli.text.jobs import key_table

    with Connection(url, key, data_dir).client() as client:
        found = client.keys()
    Talk(as_json).result([one.model_dump(mode="json") for one in found], key_table(found))


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(help="The key's id, from `keys list`.")],
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Make a key useless at once."""
    with Connection(url, key, data_dir).client() as client:
        client.revoke_key(key_id)
    Talk(as_json).result({"id": key_id, "revoked": True}, f"{key_id} revoked")


@app.command()
def link(as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR) -> None:
    """Make a link that logs a browser in, once."""
    with Connection(url, key, data_dir).client() as client:
        made = client.login_link()
    Talk(as_json).result(made.model_dump(mode="json"), made.url)
