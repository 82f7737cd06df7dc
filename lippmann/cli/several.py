"""One action on several jobs or scenes: each is tried, and the refusals are reported one by one.

All names are checked before the first action. An error that keeps the action from the other names too, such as a
service that is gone, ends the command, after the results of the actions until then are printed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import typer

from lippmann.cli.exit_codes import exit_code_of
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from service.schemas.job import Job


def act_on_each(names: Sequence[str], act: Callable[[str], tuple[Any, str]], output: Output) -> None:
    """Do something with each of several things and print the results.

    Parameters
    ----------
    names
        The ids or names. A name that is given twice counts once.
    act
        The action. It returns its result as data and as text.
    output
        The output of the command. With one name, the result is printed as it is; with several, as a list.

    Raises
    ------
    BadInput
        If a name cannot be one; then nothing is done.
    Refused
        If there is only one name and the service refuses it, or it refuses the key.
    Unreachable
        If the service does not answer.
    typer.Exit
        With the exit code of the first refusal, if there are several names. The other names are tried nevertheless.
    """
    from lippmann.client.errors import KeyRefused, Refused
    from lippmann.client.names import plain_name

    names = list(dict.fromkeys(map(plain_name, names)))
    results: list[tuple[Any, str]] = []
    refusals: list[Refused] = []
    try:
        for name in names:
            try:
                results.append(act(name))
            except Refused as error:
                if len(names) == 1 or (isinstance(error, KeyRefused) and error.status == 401):
                    raise
                output.note(f"lippmann: {name}: {error.message}")
                refusals.append(error)
    finally:
        data = [one for one, _ in results]
        if results or (output.as_json and len(names) > 1):
            output.result(data[0] if len(names) == 1 else data, "\n".join(text for _, text in results))
    if refusals:
        raise typer.Exit(exit_code_of(refusals[0]))


def status_of(job: Job) -> tuple[Any, str]:
    """Return a job after an action, as data and as text."""
    return job.model_dump(mode="json"), f"{job.id} {job.status}"
