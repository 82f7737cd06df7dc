"""Which maker makes which kind of output."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from worker.job.outputs.output import OutputOptions
from worker.job.outputs.pictures import ContactSheet, Epi, Quilt, Sheets, ViewGrid
from worker.job.outputs.videos import CentreVideo, OrthoscopicVideo, ViewsVideo
from worker.plan import names
from worker.tasks.outputs.contact_sheet import make_contact_sheet
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.pictures import make_epi, make_quilt, make_sheets, make_view_grid
from worker.tasks.outputs.sidecar import sidecar
from worker.tasks.outputs.videos import make_centre, make_orthoscopic, make_views

MAKERS: Mapping[type[OutputOptions], Callable[[Making, Any], None]] = {
    ViewsVideo: make_views,
    CentreVideo: make_centre,
    OrthoscopicVideo: make_orthoscopic,
    ViewGrid: make_view_grid,
    Quilt: make_quilt,
    Epi: make_epi,
    ContactSheet: make_contact_sheet,
    Sheets: make_sheets,
}


def make_output(making: Making) -> None:
    """Make an output, unless it is there; the file that means all is there (`names.output_name`) comes last.

    Raises
    ------
    WorkerError
        Whatever keeps it from being made; the other outputs of the job have nothing to do with it.
    """
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
    path.write_bytes(sidecar(making.footage, making.output, files))
    making.put(names.sidecar_name(making.output), path)
    path.unlink()
