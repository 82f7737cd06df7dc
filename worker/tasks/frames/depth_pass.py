"""The second pass: the depth of every pixel of a tile.

POV-Ray renders the distance along the ray of every pixel of a ray camera to the scene (lippmann/depth.inc), and the
rays are known exactly. The point that a ray meets gives the depth in the scene, and exact rays give its depth on the
display.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError, Stopped
from lippmann.job.animation.clock import Clock
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.stage import Stage
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.optics.rig.bench import Bench, bench, pixel_centres_mm
from lippmann.optics.rig.parallax import depth_on_display_mm, parallax
from lippmann.optics.rig.pixel_rays import front_mm, ray_bands
from lippmann.plan.sampling import Tile
from worker.engines.engine import Region
from worker.engines.povray.command import RenderCommand
from worker.engines.povray.engine import write_rays
from worker.engines.povray.pictures.depth_codes import FOGGY, FogLight, fog_light, fog_light_among_others
from worker.engines.povray.pictures.pixels import read_codes
from worker.engines.povray.ray_camera import FIRST_ROW, Scaffold, starts_mm
from worker.engines.povray.scene import RAYS_FILE, DepthPass, pov_text
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.picture import run_povray

DEPTH_POV_FILE = "lippmann-depth.pov"

FAR_AWAY = 1e9
"""The distance at which the first rays start, in units of the scene: beyond most objects."""

LEADING_ROWS = FIRST_ROW + 1

FOG = re.compile(rb"\bfog\b")
SDL = (".pov", ".inc", ".mcr", ".mac")


def depth_of_tile(
    place: Workplace,
    sheet: ResolvedJob,
    frame: int,
    tile: Tile,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
) -> DepthMap:
    """Return the depth of a tile, as captured.

    Raises
    ------
    SceneError
        If the rays start inside objects that are not hollow, wherever the first one does.
    LippmannError
        Whatever the scene fails with.
    """
    there = sheet.at(frame)
    optical_bench = bench(there.spec.rig, reference_mm=there.stage.reference_mm)
    layout = there.spec.rig.layout
    rows, cols = layout.rows, layout.cols
    region = Region(tile.row_start, tile.row_stop, tile.col_start, tile.col_stop)
    shared = write_rays(
        folder / RAYS_FILE, there, [optical_bench], rows=rows, cols=cols, region=region, should_stop=monitor.should_stop
    )

    def codes(depth: DepthPass) -> NDArray[np.uint16]:
        (folder / DEPTH_POV_FILE).write_text(pov_text(there, "ray_camera", depth=depth))
        command = _command(tile, sheet.clock, frame)
        picture = run_povray(place, there, command, folder=folder, log=log, monitor=monitor).picture
        return read_codes(picture)[LEADING_ROWS:]

    near_mm = _scale_mm(there.stage, optical_bench)
    first = DepthPass(outside=(0, 0, 0), cols=tile.cols, near_mm=near_mm)
    with place.bundle(sheet.bundle) as bundle:
        foggy = has_fog(bundle)
    light = found_light(codes, first, there.stage, foggy=foggy)
    return depth_map(light.distance_mm(near_mm=near_mm), optical_bench, tile, monitor, shared=shared)


def _command(tile: Tile, clock: Clock, frame: int) -> RenderCommand:
    rows = tile.rows + LEADING_ROWS
    return RenderCommand(
        pov_file=DEPTH_POV_FILE,
        picture="lippmann-depth.ppm",
        cols=tile.cols,
        rows=rows,
        picture_format="ppm16",
        region=Region(FIRST_ROW, rows, 0, tile.cols),
        clock=clock.at(frame),
        declares=clock.variables(frame),
    )


def _scale_mm(stage: Stage, optical_bench: Bench) -> float:
    """Return the approximate distance of the rays to the reference plane, mm."""
    deepest_mm = stage.far_mm + front_mm(optical_bench)
    return max(stage.near_mm + front_mm(optical_bench), deepest_mm / 10, 1.0)


def found_light(
    codes: Callable[[DepthPass], NDArray[np.uint16]], first: DepthPass, stage: Stage, *, foggy: bool
) -> FogLight:
    """Try start points of the first rays until there is fog along all of them."""
    for outside in _outside(stage):
        depth = replace(first, outside=outside)
        if foggy:
            amplitudes = (0.0, FOGGY, -FOGGY)
            light = fog_light_among_others(*(codes(replace(depth, amplitude=amplitude)) for amplitude in amplitudes))
        else:
            light = fog_light(codes(depth))
        if light.is_whole:
            return light
    raise SceneError(
        "expected a place outside of all objects that are not hollow, to measure depths from, got none: make the"
        " objects that the rig stands in hollow"
    )


def _outside(stage: Stage) -> Iterator[tuple[float, float, float]]:
    """Yield start points for the first rays: far above, at the rig, and far away in other directions."""
    up, here = np.array(stage.up), np.array(stage.location)
    ahead = np.array(stage.look_at) - here
    right = np.cross(up, ahead)
    for way in (up, None, -up, right, -right, ahead, -ahead):
        x, y, z = here if way is None else here + FAR_AWAY * way / np.linalg.norm(way)
        yield float(x), float(y), float(z)


def has_fog(bundle: Path) -> bool:
    """Return whether a scene has fog of its own; separating it from ours takes three pictures instead of one."""
    return any(FOG.search(path.read_bytes()) for path in bundle.rglob("*") if path.suffix.lower() in SDL)


def depth_map(
    distance_mm: NDArray[np.floating[Any]],
    optical_bench: Bench,
    tile: Tile,
    monitor: ProgressMonitor,
    *,
    shared: Scaffold | None = None,
) -> DepthMap:
    """Return the depth of a tile from the distances along its rays.

    Parameters
    ----------
    distance_mm
        The distance from the start of each ray to the scene, `(rows, cols)` of the tile.
    shared
        The scaffold at which the rays of the ray camera start; None if they start at their own positions.
    """
    rows, cols = optical_bench.rig.layout.rows, optical_bench.rig.layout.cols
    across = slice(tile.col_start, tile.col_stop)
    values = np.empty((tile.rows, tile.cols, 4), dtype=np.float32)
    start = 0
    for rays in ray_bands(optical_bench, rows=rows, cols=cols, region=(slice(tile.row_start, tile.row_stop), across)):
        if monitor.should_stop():
            raise Stopped
        stop = start + len(rays.position)
        along = distance_mm[start:stop, :, np.newaxis] * rays.direction
        starts = rays.position if shared is None else starts_mm(rays, shared)
        z_mm = (starts + along)[..., 2]
        band = slice(tile.row_start + start, tile.row_start + stop)
        moves = parallax(optical_bench, pixel_centres_mm(optical_bench, region=(band, across)), z_mm)
        here = values[start:stop]
        here[..., 0] = -z_mm
        here[..., 1] = depth_on_display_mm(moves, optical_bench.rig)
        here[..., 2:] = moves
        start = stop
    return DepthMap(values)
