"""One POV-Ray picture of a job: a whole frame, or a tile of it, by glass or by the ray camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from lippmann.errors import SceneError, ScratchDamaged, Stopped
from lippmann.job.render_settings import RenderSettings
from lippmann.job.resolved import ResolvedJob
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.method import capture_method
from lippmann.optics.rig.pixel_rays import front_mm, outer_rays, ray_bands
from povtemplates.catalogue import INCLUDE_FOLDER
from worker.engines.povray.command import SUFFIXES, SYSTEM_INCLUDE, PictureFormat, Region, RenderCommand
from worker.engines.povray.forecast import EndForecast
from worker.engines.povray.progress import Phase, Progress
from worker.engines.povray.ray_camera import Scaffold, ray_camera_region, ray_camera_text, scaffold
from worker.engines.povray.render import RenderOutcome, render
from worker.engines.povray.scene import RAYS_FILE, pov_text
from worker.engines.povray.scene_files import LINKS_FOLDER, SceneFiles
from worker.engines.povray.scene_variables import scene_variables
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.settings import WorkerSettings
from worker.tasks.monitor import ProgressMonitor
from worker.tasks.workplace import Workplace

POV_FILE = "lippmann-frame.pov"
"""POV-Ray searches its own folder first, so none of our files there has a name that a bundle may have."""

CPU_PER_SECOND = 4.0
"""The least limit of CPU seconds per elapsed second: photons are shot by 4 threads, whatever +WT is."""


@dataclass(frozen=True)
class RenderedPicture:
    """A picture and where in it the wanted pixels are."""

    outcome: RenderOutcome
    wanted: Region


def render_picture(
    place: Workplace,
    sheet: ResolvedJob,
    *,
    frame: int,
    rows: int,
    cols: int,
    region: Region | None,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
    picture_format: PictureFormat = "exr",
    threads: int = 1,
    is_probe: bool = False,
) -> RenderedPicture:
    """Render one picture into a folder, by way of `POV_FILE` there.

    Parameters
    ----------
    rows, cols
        Size of the whole picture, px; its window is that of the integral image, whatever its size.
    region
        The part to render, None for all.
    log
        Where POV-Ray's words go.
    picture_format
        EXR half floats, or PPM of 16 bits in linear light, for targets that code positions.
    threads
        The number of threads that trace; with more than one, see `is_parallel`.
    is_probe
        True if the limit of the probe counts too.
    """
    there = sheet.at(frame)
    wanted = region or Region(0, rows, 0, cols)
    method = capture_method(there.spec, there.stage)
    (folder / POV_FILE).write_text(pov_text(there, method))
    if method == "ray_camera":
        # Its rays are those of the region alone, and so is its picture.
        write_rays(folder / RAYS_FILE, there, rows=rows, cols=cols, region=wanted, monitor=monitor)
        cols = wanted.col_stop - wanted.col_start
        region = wanted = ray_camera_region(rows=wanted.row_stop - wanted.row_start, cols=cols)
        rows = wanted.row_stop
    settings = there.spec.render
    outcome = run_povray(
        place,
        there,
        RenderCommand(
            pov_file=POV_FILE,
            picture=f"lippmann-picture{SUFFIXES[picture_format]}",
            cols=cols,
            rows=rows,
            picture_format=picture_format,
            region=region,
            clock=sheet.clock.at(frame),
            declares=sheet.clock.variables(frame),
            antialias=None if settings.antialias == "off" else settings.antialias,
            threads=threads,
        ),
        folder=folder,
        log=log,
        monitor=monitor,
        is_probe=is_probe,
    )
    return RenderedPicture(outcome, wanted)


def run_povray(
    place: Workplace,
    sheet: ResolvedJob,
    command: RenderCommand,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
    is_probe: bool = False,
) -> RenderOutcome:
    """Run a command on a .pov in a folder; it may read our includes and the scene's bundle."""
    settings = sheet.spec.render
    forecast, announced = EndForecast(), False
    given = [path for path in folder.iterdir() if path.name != command.picture]

    def progressed(progress: Progress) -> None:
        nonlocal announced
        monitor.progress = progress.fraction
        if not announced and forecast.ends_soon(progress):
            announced = True
            monitor.announce_end()

    with place.bundle(sheet.bundle) as bundle:
        scene = SceneFiles(bundle, sheet.file, sheet.include)
        links = folder / LINKS_FOLDER
        scene.make_links(links)
        # Our includes first: a bundle may hold copies of them, older ones too.
        ours = INCLUDE_FOLDER.resolve()
        searched = tuple(dict.fromkeys((ours, *scene.folders, SYSTEM_INCLUDE, links)))
        try:
            return render(
                replace(command, library_paths=searched, program=place.settings.povray),
                task_dir=folder,
                readable=(ours, scene.bundle),
                sandbox=place.sandbox_for(sheet.bundle),
                limits=process_limits(settings, place.settings, threads=command.threads),
                times=time_limits(settings, place.settings, is_probe=is_probe),
                on_progress=progressed,
                should_stop=monitor.should_stop,
                log=log,
                scene=scene,
            )
        except SceneError as error:
            gone = [path.name for path in given if not path.exists()]
            if not gone:
                raise
            raise ScratchDamaged(f"{gone[0]} disappeared from the scratch folder while POV-Ray ran") from error


def is_parallel(place: Workplace, sheet: ResolvedJob) -> bool:
    """Return whether POV-Ray may trace a picture of a job by several threads; see `ProbeResult.parallel`.

    The ray camera has a ray of its own for each pixel, which one thread parses, so tiles are quicker with it.
    """
    if capture_method(sheet.spec, sheet.stage) != "glass" or sheet.spec.capture.depth:
        return False
    with place.bundle(sheet.bundle) as bundle:
        return not scene_variables(bundle).chance


def process_limits(job: RenderSettings, worker: WorkerSettings, *, threads: int = 1) -> Limits:
    """Return the limits of a POV-Ray process: those of the job, or lower ones of the worker."""
    timeout_s = min(job.timeout_s, worker.timeout_s)
    return Limits(cpu_s=max(CPU_PER_SECOND, threads) * timeout_s, memory_mb=min(job.memory_mb, worker.memory_mb))


def time_limits(job: RenderSettings, worker: WorkerSettings, *, is_probe: bool) -> TimeLimits:
    """Return the time limits of a picture: those of the job, or lower ones of the worker."""

    def limit(name: str) -> TimeLimit:
        of_job = TimeLimit(getattr(job, name), f"render.{name} of the job")
        return of_job.or_lower(getattr(worker, name, None), f"LIPPMANN_{name.upper()} of the worker")

    total, of_probe = limit("timeout_s"), limit("probe_timeout_s")
    return TimeLimits(
        total=total.or_lower(of_probe.seconds, of_probe.source) if is_probe else total,
        stall=limit("stall_s"),
        phases={Phase.PARSING: limit("parse_timeout_s"), Phase.PHOTONS: limit("photons_timeout_s")},
    )


def write_rays(
    path: Path, sheet: ResolvedJob, *, rows: int, cols: int, region: Region, monitor: ProgressMonitor
) -> Scaffold:
    """Write the rays of a region, some rows at a time: a tile of any size needs little memory here.

    Returns
    -------
    Scaffold
        The scaffold with which the rays were written.
    """
    optical_bench = bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm)
    wanted = slice(region.row_start, region.row_stop), slice(region.col_start, region.col_stop)
    count = (region.row_stop - region.row_start) * (region.col_stop - region.col_start)
    bands = ray_bands(optical_bench, rows=rows, cols=cols, region=wanted)
    shared = scaffold(outer_rays(optical_bench), front_mm=front_mm(optical_bench), mm_per_unit=sheet.stage.mm_per_unit)
    with path.open("wb") as file:
        for piece in ray_camera_text(bands, count, shared):
            if monitor.should_stop():
                raise Stopped
            file.write(piece)
    return shared
