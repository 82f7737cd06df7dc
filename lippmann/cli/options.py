"""Options that several commands share, and the context of a command.

A command asks for its context by type. A parameter of type `Connection` stands for the options `--url`, `--key` and
`--data-dir`, and a parameter of type `Output` stands for `--json`. `with_context` puts the options in their place.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from lippmann.client import address
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.terminal.output import Output

RECONNECT_S = 60.0
"""The time for which a command that waits for a job tries to reach the service, s."""

DATA_DIR = address.DATA_DIR

AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]
Url = Annotated[
    str | None,
    typer.Option("--url", envvar="LIPPMANN_URL", help="The URL of the service. The default is the farm of --data-dir."),
]
Key = Annotated[str | None, typer.Option("--key", envvar="LIPPMANN_KEY", help="The key to the service.")]
DataDir = Annotated[
    Path, typer.Option("--data-dir", envvar="LIPPMANN_DATA_DIR", help="The data folder of the farm on this machine.")
]
JobId = Annotated[str, typer.Argument(help="The id of the job.", metavar="JOB")]
JobIds = Annotated[list[str], typer.Argument(help="The ids of one or more jobs.", metavar="JOB...")]
# These are the names in `lippmann.job.states`, whose import would make `--help` slow.
JobStatusName = Literal["queued", "probing", "running", "paused", "done", "failed", "cancelled"]
TaskStatusName = Literal["waiting", "ready", "dispatched", "running", "done", "failed", "cancelled", "skipped"]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Set one field of the job, for example rig.px_per_lens=4. The option may be repeated.",
        metavar="FIELD=VALUE",
    ),
]
Lenses = Annotated[
    str | None,
    typer.Option("--lenses", metavar="COLSxROWS", help="The number of lenses across and down, for example 115x100."),
]
LensCount = Annotated[tuple[int, int] | None, typer.Option("--lens-count", hidden=True, metavar="ROWS COLS")]
"""The old name of `--lenses`, with the rows first."""
SceneToRender = Annotated[
    str | None, typer.Argument(metavar="[SCENE]", help="A built-in scene, or a folder or zip with a scene.")
]

JobFile = Annotated[
    str | None, typer.Option("--job", metavar="JOB.json", help="A job file, or - to read it from stdin.")
]

OutputFolder = Annotated[Path, typer.Option(help="The folder to write to.")]

Source = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="An orthoscopic master (orthoscopic/0001.exr, device/0001.exr), a folder of masters, or the id of a job.",
    ),
]
Frame = Annotated[
    int | None,
    typer.Option("--frame", min=1, help="The frame of the folder or the job. The default is the first frame."),
]

_OPTIONS: Mapping[type, Mapping[str, tuple[Any, Any]]] = {
    Output: {"as_json": (AsJson, False)},
    Connection: {"url": (Url, None), "key": (Key, None), "data_dir": (DataDir, DATA_DIR)},
}
"""The options of each part of the context, which are the arguments of its constructor: annotation and default."""


def finite(option: typer.CallbackParam, number: float | None) -> float | None:
    """Return the number of an option that goes to the service in JSON, which has no infinite ones.

    Raises
    ------
    BadInput
        If it is infinite or no number.
    """
    if number is not None and not math.isfinite(number):
        raise BadInput(f"{option.opts[0]}: expected a finite number, got {number}")
    return number


def with_context(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command for typer, with options in the place of every parameter of type `Connection` or `Output`."""
    declared = list(inspect.signature(command, eval_str=True).parameters.values())
    context = {one.name: one.annotation for one in declared if one.annotation in (Output, Connection)}
    options = {name: option for kind in context.values() for name, option in _OPTIONS[kind].items()}

    @functools.wraps(command)
    def run(**values: Any) -> None:
        parts = {name: kind(**{one: values.pop(one) for one in _OPTIONS[kind]}) for name, kind in context.items()}
        command(**values, **parts)

    parameters = [
        *(one for one in declared if one.name not in context),
        *(
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
            for name, (annotation, default) in options.items()
        ),
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # typer reads both of these
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run
