"""The sheet of a frame that is not rendered: a picture of the job's bundle, made into whole cells."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, BundleError
from lippmann.job.messages.events import ProbeResult
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.imported_sheets import file_and_page
from lippmann.lightfield.calibrate.flat_field import divided_by_white
from lippmann.lightfield.calibrate.imported import captured_of
from lippmann.plan.imported import lens_grid
from lippmann.plan.sampling import frame_size
from worker.images.foreign.colour_space import colour_space, linear_space
from worker.images.foreign.header import read_header
from worker.images.foreign.notes import header_notes
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.untrusted import read_imported


def imported_sheet(place: Workplace, sheet: ResolvedJob, frame: int, monitor: ProgressMonitor) -> NDArray[np.float16]:
    """Return the imported image of a frame as direct pickup would have captured it, `(rows, cols, 3)`.

    Raises
    ------
    BundleError
        If the picture is not whole, of another format than those that are read, or too large.
    LayoutError
        If the lenses do not lie on it.
    Stopped
        If the work should end.
    """
    said = sheet.sheets
    assert said is not None  # noqa: S101 - its caller's promise
    picture = _read(place, sheet, said.files[frame - 1], monitor, field="files")
    if said.white is not None:
        picture = divided_by_white(picture, _read(place, sheet, said.white, monitor, field="white"))
    grid = lens_grid(said, picture.shape[:2])
    layout = grid.layout(said.px_per_lens)
    captured = captured_of(picture, grid, layout, pseudoscopic=said.pseudoscopic, inverted=said.inverted)
    return captured.astype(np.float16)


def _read(
    place: Workplace, sheet: ResolvedJob, name: str, monitor: ProgressMonitor, *, field: str
) -> NDArray[np.float32]:
    """Return a picture of the bundle in linear light."""
    said = sheet.sheets
    assert said is not None  # noqa: S101 - its caller's promise
    file, page = file_and_page(name)
    try:
        with place.task_folder() as scratch, place.bundle(sheet.bundle) as bundle:
            return read_imported(
                bundle / file,
                page=page,
                linear=said.linear,
                white_level=said.white_level,
                sandbox=place.sandbox_for(sheet.bundle),
                at_most_px=place.settings.picture_px,
                scratch=scratch,
                should_stop=monitor.should_stop,
            )
    except ArtifactBroken as error:
        raise BundleError(f"sheets.{field}: {name}: expected a whole picture, got {error.message}") from error


def probe_imported(place: Workplace, sheet: ResolvedJob, log: AttemptLog, monitor: ProgressMonitor) -> ProbeResult:
    """Read the first frame and measure the time; such a job renders nothing. The log names its colour space."""
    assert sheet.sheets is not None  # noqa: S101 - its caller's promise
    frame = sheet.spec.frame_numbers[0]
    began_s = time.process_time()
    imported_sheet(place, sheet, frame, monitor)
    name = sheet.sheets.files[frame - 1]
    with place.bundle(sheet.bundle) as bundle:
        header = read_header(bundle / file_and_page(name)[0])
    space = linear_space(None) if sheet.sheets.linear else colour_space(header)
    source = "sheets.linear" if sheet.sheets.linear else space.known_by or "nothing in the file"
    log.write(f"{name}: colour space {space.name}, named by {source}")
    for note in header_notes(header, linear=sheet.sheets.linear):
        log.write(f"{name}: {note}")
    s_per_px = (time.process_time() - began_s) / frame_size(sheet.spec.rig).px
    return ProbeResult(start_s=0.0, s_per_px=s_per_px, tileable=False, renders=False)
