"""Maker of integral images for other displays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.spoc import Spoc
from lippmann.lightfield.sheet.bands import OrthoscopicSheet, Sheet, stitched
from lippmann.lightfield.sheet.pinholes import PinholeArray
from lippmann.lightfield.sheet.spoc import SpocSheet
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from worker.images.bands.rows import BAND_PX, all_rows, open_rows
from worker.images.colour import srgb_codes
from worker.images.write import write_code_rows, write_exr_rows
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.pictures import sheet_density
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.sidecar import geometry_of


@makes(Spoc)
def make_spoc(context: OutputContext, output: Spoc) -> None:
    """Make the integral image of every frame for a display, as a master and as a picture."""
    frames = context.source.frames
    for frame in context.with_progress(frames, len(frames)):
        files = [f"{names.frame_stem(frame)}{suffix}" for suffix in (".exr", ".png")]
        if all(context.exists(context.name(file)) for file in files):
            context.stored.extend(map(context.name, files))
            continue
        master = context.scratch / "master.exr"
        _write_master(master, context.source, output, frame)
        context.store_file(files[0], partial(Path.hardlink_to, target=master))
        context.store_file(
            files[1], partial(_write_picture, master=master, output=output, rig=context.source.rig(frame))
        )
        master.unlink()


@describes(Spoc)
def about_spoc(source: FrameSource, output: Spoc) -> Mapping[str, Any]:
    """Describe the integral images for a display for the sidecar."""
    rig = source.rig(source.frames[0])
    shown = output.display(rig)
    return {
        "method": "SPOC: Navarro et al., Optics Express 18(25), 25573 (2010)",
        "integral_image": geometry_of(display_size(shown), shown),
        "distance_mm": output.distance_mm,
        "reference_mm": output.reference_of(rig),
    }


def spoc_sheet(pseudoscopic: Sheet, rig: Rig, output: Spoc) -> SpocSheet:
    """Return the sheet for a display of a capture, whose picture is upright, by a rig."""
    shown = output.display(rig)
    array, new = rig.lens_array, shown.lens_array
    return SpocSheet(
        pseudoscopic,
        capture=PinholeArray(pseudoscopic.layout, array.pitch_mm, array.focal_length_mm),
        display=PinholeArray(display_size(shown), new.pitch_mm, new.focal_length_mm),
        distance_mm=output.distance_mm,
        reference_mm=output.reference_of(rig),
    )


def _write_master(path: Path, source: FrameSource, output: Spoc, frame: int) -> None:
    rig = source.rig(frame)
    said = {**source.facts, "frame": str(frame), "rig": output.display(rig).model_dump_json()}
    with source.orthoscopic_rows(frame) as sheet:
        # The half-turn is its own inverse: this is the capture as it was, but upright.
        made = spoc_sheet(OrthoscopicSheet(sheet, inverted=False), rig, output)
        size = made.layout.rows, made.layout.cols
        write_exr_rows(path, stitched(made, BAND_PX), size=size, attributes=said)


def _write_picture(path: Path, *, master: Path, output: Spoc, rig: Rig) -> None:
    shown = output.display(rig)
    density = sheet_density(display_size(shown), pitch_mm=shown.lens_array.pitch_mm)
    with open_rows(master, dtype=np.float16) as picture:
        codes = map(partial(srgb_codes, bits=output.bits), all_rows(picture))
        write_code_rows(path, codes, size=(picture.rows, picture.cols), bits=output.bits, density=density)
