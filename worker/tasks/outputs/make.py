"""Which maker makes which kind of output."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from lippmann.job.outputs.clips import FocusVideo, SweepVideo
from lippmann.job.outputs.datasets import HciFolder, LensletVideo, NpzArrays, SubapertureViews
from lippmann.job.outputs.depth import DepthPictures
from lippmann.job.outputs.observer import ObserverPictures, ObserverVideo
from lippmann.job.outputs.output import OutputOptions
from lippmann.job.outputs.pictures import ContactSheet, Epi, Quilt, Sheets, ViewGrid
from lippmann.job.outputs.prints import CalibrationSheet, Print
from lippmann.job.outputs.spoc import Spoc
from lippmann.job.outputs.stereo import AnaglyphVideo, StereoVideo
from lippmann.job.outputs.videos import CentreVideo, IntegralVideo, OrthoscopicVideo, ViewsVideo
from lippmann.plan import artifact_names as names
from worker.tasks.outputs.calibration import about_calibration_sheet, make_calibration_sheet
from worker.tasks.outputs.clips import about_focus, make_focus, make_sweep
from worker.tasks.outputs.contact_sheet import make_contact_sheet
from worker.tasks.outputs.datasets import (
    about_hci,
    about_npz,
    about_subaperture_ppm,
    make_hci,
    make_npz,
    make_subaperture_ppm,
)
from worker.tasks.outputs.depth import about_depth, make_depth
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.lenslet_video import about_mpeg_lenslet, make_mpeg_lenslet
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.observer import about_observer, make_observer, make_observer_pictures
from worker.tasks.outputs.pictures import about_quilt, make_epi, make_quilt, make_sheets, make_view_grid
from worker.tasks.outputs.prints import about_print, make_print
from worker.tasks.outputs.sidecar import sidecar
from worker.tasks.outputs.spoc import about_spoc, make_spoc
from worker.tasks.outputs.stereo import about_pair, make_anaglyph, make_stereo
from worker.tasks.outputs.videos import make_centre, make_integral, make_orthoscopic, make_views

MAKERS: Mapping[type[OutputOptions], Callable[[Making, Any], None]] = {
    ViewsVideo: make_views,
    CentreVideo: make_centre,
    OrthoscopicVideo: make_orthoscopic,
    ObserverVideo: make_observer,
    ObserverPictures: make_observer_pictures,
    IntegralVideo: make_integral,
    SweepVideo: make_sweep,
    FocusVideo: make_focus,
    StereoVideo: make_stereo,
    AnaglyphVideo: make_anaglyph,
    ViewGrid: make_view_grid,
    Quilt: make_quilt,
    Epi: make_epi,
    ContactSheet: make_contact_sheet,
    Sheets: make_sheets,
    DepthPictures: make_depth,
    Spoc: make_spoc,
    HciFolder: make_hci,
    SubapertureViews: make_subaperture_ppm,
    LensletVideo: make_mpeg_lenslet,
    NpzArrays: make_npz,
    Print: make_print,
    CalibrationSheet: make_calibration_sheet,
}

ABOUT: Mapping[type[OutputOptions], Callable[[Footage, Any], Mapping[str, Any]]] = {
    FocusVideo: about_focus,
    StereoVideo: about_pair,
    AnaglyphVideo: about_pair,
    ObserverVideo: about_observer,
    ObserverPictures: about_observer,
    DepthPictures: about_depth,
    HciFolder: about_hci,
    SubapertureViews: about_subaperture_ppm,
    LensletVideo: about_mpeg_lenslet,
    NpzArrays: about_npz,
    Quilt: about_quilt,
    Print: about_print,
    Spoc: about_spoc,
    CalibrationSheet: about_calibration_sheet,
}
"""What a sidecar says of a kind's own files, where there is anything to say."""


def make_output(making: Making) -> None:
    """Make an output, unless it is there; the file that means all is there (`names.output_name`) comes last.

    Raises
    ------
    LippmannError
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
    about = ABOUT.get(type(making.output))
    said = about(making.footage, making.output) if about else None
    path.write_bytes(sidecar(making.footage, making.output, files, said))
    making.put(names.sidecar_name(making.output), path)
    path.unlink()
