"""The registry of makers: which function makes which kind of output, and which one describes its files.

A maker and its kind are registered where they are defined; `discover_makers` imports the modules of this package.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, TypeVar

from lippmann.job.outputs.output import OutputOptions
from lippmann.plan import artifact_names as names
from worker.tasks import outputs
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.sidecar import sidecar

Options = TypeVar("Options", bound=OutputOptions)
Maker = Callable[[OutputContext, Options], None]
Description = Callable[[FrameSource, Options], Mapping[str, Any]]

MAKERS: dict[type[OutputOptions], Maker[Any]] = {}
"""The makers, by the options of their kind."""

DESCRIPTIONS: dict[type[OutputOptions], Description[Any]] = {}
"""Functions that return what a sidecar says about the files of a kind; kinds without peculiarities have none."""


def makes(kind: type[Options]) -> Callable[[Maker[Options]], Maker[Options]]:
    """Register a function as the maker of a kind of output; a decorator."""

    def register(maker: Maker[Options]) -> Maker[Options]:
        MAKERS[kind] = maker
        return maker

    return register


def describes(*kinds: type[OutputOptions]) -> Callable[[Description[Options]], Description[Options]]:
    """Register a function that describes the files of some kinds of output for their sidecars; a decorator."""

    def register(description: Description[Options]) -> Description[Options]:
        DESCRIPTIONS.update(dict.fromkeys(kinds, description))
        return description

    return register


@cache
def discover_makers() -> None:
    """Import every module of this package, so that the makers of all kinds are registered."""
    for module in iter_modules(outputs.__path__, f"{outputs.__name__}."):
        import_module(module.name)


def make_output(context: OutputContext) -> None:
    """Make an output, unless it is stored; the file that marks it as complete (`names.output_name`) is stored last.

    Raises
    ------
    LippmannError
        If the output cannot be made; the other outputs of the job are made nevertheless.
    """
    discover_makers()
    output = context.output
    whole = names.output_name(output)
    if context.exists(whole):
        return
    if output.IS_VIDEO:
        _put_sidecar(context, [whole])
        MAKERS[type(output)](context, output)
    else:
        MAKERS[type(output)](context, output)
        _put_sidecar(context, context.stored)


def _put_sidecar(context: OutputContext, files: list[str]) -> None:
    path = context.scratch / "sidecar.json"
    describe = DESCRIPTIONS.get(type(context.output))
    description = describe(context.source, context.output) if describe else None
    path.write_bytes(sidecar(context.source, context.output, files, description))
    context.put(names.sidecar_name(context.output), path)
    path.unlink()
