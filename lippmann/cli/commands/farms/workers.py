"""The workers that are online: list, drain, exclude and forgive them."""

from __future__ import annotations

from typing import Annotated

import typer

from lippmann.cli.options import with_context
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

app = typer.Typer(
    help="List, drain, exclude and forgive the workers online.",
    invoke_without_command=True,
)

Name = Annotated[str, typer.Argument(help="The name of the worker, as `lippmann workers` shows it.")]


@app.callback()
@with_context
def list_workers(context: typer.Context, output: Output, connection: Connection) -> None:
    """List, drain, exclude and forgive the workers online."""
    import time

    from lippmann.cli.text.farm import worker_table, workers_data
    from lippmann.errors import FarmFailed

    if context.invoked_subcommand is not None:
        return
    with connection.client() as client:
        found = client.workers()
    if not found.known:
        raise FarmFailed("expected the broker to name the workers, got no answer from it")
    output.result(workers_data(found.items), worker_table(found.items, now_s=time.time()))


@app.command()
@with_context
def drain(
    name: Name,
    undo: Annotated[bool, typer.Option("--undo", help="Let the worker take orders again.")] = False,
    ends: Annotated[
        bool, typer.Option("--exit", help="The worker process ends, with exit code 0, when its tasks are done.")
    ] = False,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Let a worker take no further orders and finish its tasks. It needs an admin key.

    A restart of the worker ends the drain, so an upgrade is a drain and a restart.
    """
    from lippmann.errors import BadInput

    if undo and ends:
        raise BadInput("expected --undo or --exit, got both")
    with connection.client() as client:
        if undo:
            client.undrain(name)
        else:
            client.drain(name, ends=ends)
    after = "takes orders again" if undo else "takes no further orders" + (" and ends when its tasks are done" * ends)
    output.result({"worker": name, "draining": not undo, "ends": ends}, f"{name} {after}.")


@app.command()
@with_context
def exclude(
    name: Name,
    undo: Annotated[bool, typer.Option("--undo", help="Let the worker take orders again.")] = False,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Let a worker take no further orders, however often it restarts. It needs an admin key."""
    with connection.client() as client:
        if undo:
            client.include(name)
        else:
            client.exclude(name)
    after = "takes orders again" if undo else "takes no further orders until it is included again"
    output.result({"worker": name, "excluded": not undo}, f"{name} {after}.")


@app.command()
@with_context
def forgive(name: Name, *, output: Output, connection: Connection) -> None:
    """Forget the failures of a worker, so that no job avoids it. It needs an admin key."""
    with connection.client() as client:
        client.forgive(name)
    output.result({"worker": name, "forgiven": True}, f"No job avoids {name}.")
