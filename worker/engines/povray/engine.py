"""POV-Ray behind the protocol of engines: a whole frame, or a tile of it, by glass or by the ray camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError, ScratchDamaged, Stopped
from lippmann.job.resolved import ResolvedJob
from lippmann.optics.rig.bands import wavelength_bands
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.method import capture_method
from lippmann.optics.rig.pixel_rays import front_mm, joined, outer_rays, ray_bands
from lippmann.plan.render_cache import RenderSoftware
from povtemplates.catalogue import INCLUDE_FOLDER
from worker.engines.engine import Region, Rendered, Room, SceneUse, Wanted
from worker.engines.povray.answers.forecast import EndForecast
from worker.engines.povray.answers.progress import Progress
from worker.engines.povray.command import SUFFIXES, SYSTEM_INCLUDE, PictureFormat, RenderCommand
from worker.engines.povray.pictures.pixels import read_bands
from worker.engines.povray.ray_camera import Scaffold, ray_camera_region, ray_camera_text, scaffold
from worker.engines.povray.render import RenderOutcome, render
from worker.engines.povray.scene import RAYS_FILE, pov_text
from worker.engines.povray.scenes.scene_files import LINKS_FOLDER, SceneFiles
from worker.engines.povray.scenes.scene_variables import scene_variables
from worker.engines.povray.software import render_software
from worker.engines.povray.version import check_povray

POV_FILE = "lippmann-frame.pov"
"""POV-Ray searches its own folder first, so none of our files there has a name that a bundle may have."""


@dataclass(frozen=True)
class RenderedPicture:
    """A picture and where in it the wanted pixels are."""

    outcome: RenderOutcome
    wanted: Region
    """The pixels of the first wavelength band; those of the others follow below it."""
    weights: tuple[tuple[float, float, float], ...] = ((1.0, 1.0, 1.0),)
    """The shares of each wavelength band in red, green and blue."""

    def light(self) -> NDArray[np.float16]:
        """Return the wanted pixels, `(rows, cols, 3)`, linear light: the bands in their shares."""
        return read_bands(self.outcome.picture, self.wanted, self.weights)


class PovrayEngine:
    """POV-Ray; see `worker.engines.engine.Engine`."""

    name: Literal["povray"] = "povray"
    has_channels = False
    is_warm = False
    has_source = True

    def check_installed(self, program: str) -> None:
        """Check that POV-Ray is installed."""
        check_povray(program)

    def end(self) -> None:
        """Do nothing: each picture has a process of its own."""

    def software(self, program: str) -> RenderSoftware:
        """Return the software that makes the pixels."""
        return render_software(program)

    def scene_use(self, bundle: Path) -> SceneUse:
        """Return which variables of the animation the scene reads, and whether it reads the time of day."""
        variables = scene_variables(bundle)
        return SceneUse(clock=variables.clock, frames=variables.frames, now=variables.now)

    def is_parallel(self, job: ResolvedJob, bundle: Path) -> bool:
        """Return whether POV-Ray may trace a picture of a job by several threads; see `ProbeResult.parallel`.

        The ray camera has a ray of its own for each pixel, which one thread parses, so tiles are quicker with it.
        """
        if capture_method(job.spec, job.stage) != "glass" or job.spec.capture.depth:
            return False
        return not scene_variables(bundle).chance

    def render(self, wanted: Wanted, room: Room) -> Rendered:
        """Render a region of a frame, by way of `POV_FILE` in the folder of the task."""
        picture = render_picture(wanted, room)
        outcome = picture.outcome
        return Rendered(
            light=picture.light(),
            start_s=max(0.0, outcome.wall_s - outcome.statistics.trace_s),
            trace_cpu_s=outcome.statistics.trace_cpu_s,
            tileable=not outcome.radiosity_seen,
            source=room.folder / POV_FILE,
        )


def render_picture(wanted: Wanted, room: Room, *, picture_format: PictureFormat = "exr") -> RenderedPicture:
    """Render one picture into the folder of the task.

    Parameters
    ----------
    picture_format
        EXR half floats, or PPM of 16 bits in linear light, for targets that code positions.
    """
    there, clock = wanted.job.at(wanted.frame), wanted.job.clock
    rows, cols, region, part = wanted.rows, wanted.cols, wanted.region, wanted.part
    method = capture_method(there.spec, there.stage)
    (room.folder / POV_FILE).write_text(pov_text(there, method))
    weights: tuple[tuple[float, float, float], ...] = ((1.0, 1.0, 1.0),)
    if method == "ray_camera":
        # Its rays are those of the region alone, and so is its picture; the wavelength bands are below each other.
        bands = wavelength_bands(_bench(there), there.spec.capture.bands)
        weights = tuple(band.weights for band in bands)
        benches = [band.bench for band in bands]
        path = room.folder / RAYS_FILE
        write_rays(path, there, benches, rows=rows, cols=cols, region=part, should_stop=room.should_stop)
        band_rows, cols = part.row_stop - part.row_start, part.col_stop - part.col_start
        part = ray_camera_region(rows=band_rows, cols=cols)
        region = ray_camera_region(rows=len(bands) * band_rows, cols=cols)
        rows = region.row_stop
    antialias = there.spec.render.antialias
    command = RenderCommand(
        pov_file=POV_FILE,
        picture=f"lippmann-picture{SUFFIXES[picture_format]}",
        cols=cols,
        rows=rows,
        picture_format=picture_format,
        region=region,
        clock=clock.at(wanted.frame),
        declares=clock.variables(wanted.frame),
        antialias=None if antialias == "off" else antialias,
        threads=wanted.threads,
    )
    return RenderedPicture(run_povray(room, there, command), part, weights)


def _bench(job: ResolvedJob) -> Bench:
    return bench(job.spec.rig, reference_mm=job.stage.reference_mm)


def run_povray(room: Room, job: ResolvedJob, command: RenderCommand) -> RenderOutcome:
    """Run a command on a .pov in the folder of the task; it may read our includes and the scene's bundle."""
    forecast, announced = EndForecast(), False
    given = [path for path in room.folder.iterdir() if path.name != command.picture]

    def progressed(progress: Progress) -> None:
        nonlocal announced
        room.on_progress(progress.fraction)
        if not announced and forecast.ends_soon(progress):
            announced = True
            room.announce_end()

    scene = SceneFiles(room.bundle, job.file, job.include)
    links = room.folder / LINKS_FOLDER
    scene.make_links(links)
    # Our includes first: a bundle may hold copies of them, older ones too.
    ours = INCLUDE_FOLDER.resolve()
    searched = tuple(dict.fromkeys((ours, *scene.folders, SYSTEM_INCLUDE, links)))
    try:
        return render(
            replace(command, library_paths=searched, program=room.program),
            task_dir=room.folder,
            readable=(ours, scene.bundle),
            sandbox=room.sandbox,
            limits=room.limits,
            times=room.times,
            on_progress=progressed,
            should_stop=room.should_stop,
            log=room.log,
            scene=scene,
        )
    except SceneError as error:
        gone = [path.name for path in given if not path.exists()]
        if not gone:
            raise
        raise ScratchDamaged(f"{gone[0]} disappeared from the scratch folder while POV-Ray ran") from error


def write_rays(
    path: Path,
    job: ResolvedJob,
    benches: Sequence[Bench],
    *,
    rows: int,
    cols: int,
    region: Region,
    should_stop: Callable[[], bool],
) -> Scaffold:
    """Write the rays of a region, some rows at a time: a tile of any size needs little memory here.

    Parameters
    ----------
    benches
        The benches whose rays are written one below the other: one bench, or one a wavelength band.

    Returns
    -------
    Scaffold
        The scaffold with which the rays were written.
    """
    wanted = slice(region.row_start, region.row_stop), slice(region.col_start, region.col_stop)
    count = len(benches) * (region.row_stop - region.row_start) * (region.col_stop - region.col_start)
    strips = chain.from_iterable(ray_bands(one, rows=rows, cols=cols, region=wanted) for one in benches)
    outer = joined(map(outer_rays, benches))
    shared = scaffold(outer, front_mm=front_mm(benches[0]), mm_per_unit=job.stage.mm_per_unit)
    with path.open("wb") as file:
        for piece in ray_camera_text(strips, count, shared):
            if should_stop():
                raise Stopped
            file.write(piece)
    return shared
