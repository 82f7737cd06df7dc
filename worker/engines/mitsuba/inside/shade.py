"""A region of a picture: rays, radiance and channels, in bands of rows so that memory stays bounded."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.ray import Ray
from lippmann.optics.rig.bands import wavelength_bands
from lippmann.optics.rig.bench import bench
from worker.engines.mitsuba.inside.channels import channel_values, check_channels, holds_splats
from worker.engines.mitsuba.inside.messages import FileKind, Request
from worker.engines.mitsuba.inside.motion import motion_values
from worker.engines.mitsuba.inside.path import path_radiance
from worker.engines.mitsuba.inside.rays import Pixels, Placement
from worker.engines.mitsuba.inside.scenes import splats
from worker.engines.mitsuba.inside.whitted import whitted_radiance

BAND_PX = 600_000
"""The number of pixels that are traced at once: each kernel has a cost of its own, and 600,000 pixels take 260 MB."""

Float32 = NDArray[np.float32]


def bands(request: Request) -> Iterator[range]:
    """Yield the rows of the region, some at a time, as numbers of rows of the whole picture."""
    row_start, row_stop, col_start, col_stop = request.region
    step = max(1, BAND_PX // (col_stop - col_start))
    for start in range(row_start, row_stop, step):
        yield range(start, min(start + step, row_stop))


def shade_band(
    scene: mi.Scene, request: Request, rows: range, later: mi.Scene | None = None
) -> dict[FileKind, Float32]:
    """Return the wanted radiance and channels of some rows of a region, each float32 (pixel, number).

    Parameters
    ----------
    scene
        The scene, loaded.
    request
        The request.
    rows
        The rows of the whole picture; see `bands`.
    later
        The scene at the next frame, for the channel `motion`.

    Raises
    ------
    UnsupportedError
        If the scene does not have a channel.
    """
    check_channels(scene, request.kinds)
    stage, settings = request.job.stage, request.job.spec.render
    optical_bench = bench(request.job.spec.rig, reference_mm=stage.reference_mm)
    placement = Placement.of(stage)
    pixels = Pixels.of(optical_bench, request, rows)
    others = tuple(kind for kind in request.kinds if kind not in ("radiance", "motion"))
    values: dict[FileKind, Float32] = {}
    total = mi.Color3f(0)
    spectrum = wavelength_bands(optical_bench, request.job.spec.capture.bands)
    is_dispersing = len(spectrum) > 1
    is_whitted = request.light and settings.samples == 1 and not is_dispersing
    if others or later is not None or is_whitted:
        # The channels of a dispersing rig are those of the d line.
        rays = pixels.rays(optical_bench)
        ray, alive = _ray(rays, placement)
        seen = splats.radiance(scene, ray, alive) if holds_splats(scene) else None
        if seen:
            dr.eval(seen.radiance, seen.distance)  # both by the same pass
        if others:
            values = channel_values(scene, rays, (ray, alive), placement, others, seen)
        if later is not None and request.next_job is not None:
            values["motion"] = motion_values(scene, later, (ray, alive), stage, request.next_job.stage)
        if is_whitted:
            light = seen.radiance if seen else whitted_radiance(scene, ray, settings.path_depth, alive)
            total = _bounded(light, settings.clamp)
    if not request.light:
        return values
    for sample in range(0 if is_whitted else settings.samples):
        for band in spectrum:
            sent = _ray(pixels.sample_rays(band.bench, request, sample), placement)
            light = _bounded(_sample_radiance(scene, request, pixels, sent, sample), settings.clamp)
            total += light * mi.Color3f(*band.weights)
            dr.eval(total)
    values["radiance"] = np.ascontiguousarray(np.array(total, dtype=np.float32).T) / np.float32(settings.samples)
    return values


def _ray(ray: Ray, placement: Placement) -> tuple[mi.Ray3f, mi.Bool]:
    """Return rays of the rig frame as rays of the scene, and which are alive; a dead one gets any direction."""
    alive = dr.isfinite(sum(ray.position) + sum(ray.direction))
    there = placement.ray(ray)
    there.o, there.d = dr.select(alive, there.o, 0), dr.select(alive, there.d, mi.Vector3f(0, 0, 1))
    return there, alive


def _sample_radiance(
    scene: mi.Scene, request: Request, pixels: Pixels, sent: tuple[mi.Ray3f, mi.Bool], sample: int
) -> Any:
    """Return the radiance of one sample of each pixel, `mi.Color3f`."""
    (ray, alive), settings = sent, request.job.spec.render
    if holds_splats(scene):
        return splats.radiance(scene, ray, alive).radiance
    if settings.samples == 1:
        return whitted_radiance(scene, ray, settings.path_depth, alive)
    state, sequence = (mi.UInt64(word) for word in pixels.words(request.frame, sample, stream=1))
    random = mi.PCG32()
    random.seed(state, sequence)
    return path_radiance(scene, ray, random, settings.path_depth, alive)


def _bounded(radiance: Any, clamp: float | None) -> Any:
    """Return radiances without what is no number, and scaled so that no channel exceeds the clamp."""
    finite = dr.select(dr.all(dr.isfinite(radiance)), radiance, 0)
    return finite if clamp is None else finite * dr.minimum(1, clamp / dr.maximum(dr.max(finite), 1e-30))
