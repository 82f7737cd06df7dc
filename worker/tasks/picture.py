"""One POV-Ray picture of a job: a whole frame, or a tile of it."""

from __future__ import annotations

from pathlib import Path

from povtemplates.catalogue import INCLUDE_FOLDER
from worker.job.sheet import JobSheet
from worker.plan.sampling import Tile
from worker.povray.command import SYSTEM_INCLUDE, PictureFormat, Region, RenderCommand
from worker.povray.limits import Limits
from worker.povray.log import AttemptLog
from worker.povray.progress import Progress
from worker.povray.render import RenderOutcome, render
from worker.povray.scene import pov_text
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace

POV_FILE = "frame.pov"

CPU_PER_SECOND = 4.0
"""Photons are shot by 4 threads whatever +WT says, so CPU may run that much faster than the clock."""


def render_picture(
    place: Workplace,
    sheet: JobSheet,
    *,
    frame: int,
    rows: int,
    cols: int,
    tile: Tile | None,
    folder: Path,
    log: AttemptLog,
    watch: Watch,
    picture_format: PictureFormat = "exr",
) -> RenderOutcome:
    """Render one picture into a folder, by way of `frame.pov` there.

    Parameters
    ----------
    rows, cols
        Size of the whole picture, px; its window is the lens array, whatever its size.
    tile
        The part to render; the rest stays black.
    log
        Where POV-Ray's words go.
    picture_format
        EXR half floats, or PNG of 16 bits in linear light, for targets that code positions.
    """
    bundle = place.bundle_folder(sheet.bundle)
    (folder / POV_FILE).write_text(pov_text(sheet))
    readable = (bundle, INCLUDE_FOLDER.resolve())
    command = RenderCommand(
        pov_file=POV_FILE,
        picture=f"picture.{'exr' if picture_format == 'exr' else 'png'}",
        cols=cols,
        rows=rows,
        picture_format=picture_format,
        region=Region(tile.row_start, tile.row_stop, tile.col_start, tile.col_stop) if tile else None,
        clock=sheet.clock.at(frame),
        library_paths=(*readable, SYSTEM_INCLUDE),
        program=place.settings.povray,
    )
    settings = sheet.spec.render

    def progressed(progress: Progress) -> None:
        watch.progress = progress.fraction

    return render(
        command,
        task_dir=folder,
        readable=readable,
        sandbox=place.sandbox,
        limits=Limits(cpu_s=CPU_PER_SECOND * settings.timeout_s, memory_mb=settings.memory_mb),
        timeout_s=settings.timeout_s,
        stall_s=settings.stall_s,
        on_progress=progressed,
        should_stop=watch.should_stop,
        log=log,
    )
