"""Make one output by the maker of its kind, with its sidecar."""

from __future__ import annotations

from lippmann.plan import artifact_names as names
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.registry import DESCRIPTIONS, MAKERS, discover_makers
from worker.tasks.outputs.sidecar import sidecar


def make_output(making: Making) -> None:
    """Make an output, unless it is there; the file that means all is there (`names.output_name`) comes last.

    Raises
    ------
    LippmannError
        Whatever keeps it from being made; the other outputs of the job have nothing to do with it.
    """
    discover_makers()
    output = making.output
    whole = names.output_name(output)
    if making.is_there(whole):
        return
    if output.IS_VIDEO:
        _put_sidecar(making, [whole])
        MAKERS[type(output)](making, output)
    else:
        MAKERS[type(output)](making, output)
        _put_sidecar(making, making.kept)


def _put_sidecar(making: Making, files: list[str]) -> None:
    path = making.scratch / "sidecar.json"
    describe = DESCRIPTIONS.get(type(making.output))
    description = describe(making.footage, making.output) if describe else None
    path.write_bytes(sidecar(making.footage, making.output, files, description))
    making.put(names.sidecar_name(making.output), path)
    path.unlink()
