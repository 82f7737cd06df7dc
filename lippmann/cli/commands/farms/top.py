"""A picture of a farm that is drawn again and again."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.cli.text.top import Sample
    from lippmann.client import Client

Once = Annotated[bool, typer.Option("--once", help="Show the farm once, after one interval, and end.")]
Interval = Annotated[
    float, typer.Option("--interval", min=0.5, max=3600.0, help="The seconds between two readings of the farm.")
]


def top(once: Once = False, interval: Interval = 2.0, *, output: Output, connection: Connection) -> None:
    """Show workers, slots, jobs and rates, and refresh them.

    Ctrl-C ends it. On a terminal the screen is redrawn. In a pipe each reading follows the
    last, and with --json each is a line.
    """
    from lippmann.cli.options import RECONNECT_S

    with connection.client(patience_s=RECONNECT_S) as client:
        try:
            if sys.stdout.isatty() and not once and not output.as_json:
                _draw(client, interval)
            else:
                _print(client, interval, output, once=once)
        except KeyboardInterrupt:
            return  # The user ends it, which is a success.


def _samples(client: Client, interval: float) -> Iterator[tuple[Sample | None, Sample]]:
    """Yield what the farm says, and what it said before, without end."""
    from lippmann.cli.text.top import sample

    before: Sample | None = None
    while True:
        now = sample(client, before, at_s=time.monotonic())
        yield before, now
        before = now
        time.sleep(interval)


def _print(client: Client, interval: float, output: Output, *, once: bool) -> None:
    from lippmann.cli.text.top import top_data, top_text

    for before, now in _samples(client, interval):
        if before is None:
            continue  # A rate needs two readings.
        output.result(top_data(before, now), top_text(before, now, now_s=time.time()) + ("" if once else "\n"))
        if once:
            return


def _draw(client: Client, interval: float) -> None:
    from rich.live import Live

    from lippmann.cli.text.top import top_screen

    with Live(screen=True, auto_refresh=False) as live:
        for before, now in _samples(client, interval):
            live.update(top_screen(before, now, now_s=time.time()), refresh=True)
