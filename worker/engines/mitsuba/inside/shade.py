"""A region of a picture: rays, radiance and channels, in bands of rows so that memory stays bounded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.trace import Rays
from lippmann.optics.rig.bench import Bench, bench
from worker.engines.mitsuba.inside.channels import channel_values, check_channels, holds_splats
from worker.engines.mitsuba.inside.messages import FileKind, Request
from worker.engines.mitsuba.inside.path import path_radiance
from worker.engines.mitsuba.inside.rays import Placement, centre_rays, hashed, pixel_numbers, sample_rays
from worker.engines.mitsuba.inside.scenes import splats
from worker.engines.mitsuba.inside.whitted import whitted_radiance

BAND_PX = 200_000
"""The number of pixels that are traced at once."""

Float32 = NDArray[np.float32]


def bands(request: Request) -> Iterator[range]:
    """Yield the rows of the region, some at a time, as numbers of rows of the whole picture."""
    row_start, row_stop, col_start, col_stop = request.region
    step = max(1, BAND_PX // (col_stop - col_start))
    for start in range(row_start, row_stop, step):
        yield range(start, min(start + step, row_stop))


def shade_band(scene: mi.Scene, request: Request, rows: range) -> dict[FileKind, Float32]:
    """Return the radiance and channels of some rows of a region, each float32 (pixel, number).

    Parameters
    ----------
    scene
        The scene, loaded.
    request
        The request.
    rows
        The rows of the whole picture; see `bands`.
    """
    stage = request.job.stage
    optical_bench = bench(request.job.spec.rig, reference_mm=stage.reference_mm)
    placement = Placement.of(stage)
    check_channels(scene, request.kinds)
    others = tuple(kind for kind in request.kinds if kind != "radiance")
    one = request.job.spec.render.samples == 1
    centres = centre_rays(optical_bench, request, rows) if one or others else None
    samples = [centres] if one and centres else _samples(optical_bench, request, rows)
    values: dict[FileKind, Float32] = {"radiance": _radiance(scene, request, samples, placement, rows)}
    if others and centres:
        values |= channel_values(scene, centres, _scene_rays(centres, placement), placement, others)
    return values


def _samples(optical_bench: Bench, request: Request, rows: range) -> Iterator[Rays]:
    for sample in range(request.job.spec.render.samples):
        yield sample_rays(optical_bench, request, rows, sample)


def _radiance(scene: mi.Scene, request: Request, samples: Iterable[Rays], placement: Placement, rows: range) -> Float32:
    """Return the mean radiance of the samples of pixels, (pixel, 3): sums in the order of the samples."""
    settings = request.job.spec.render
    numbers = pixel_numbers(request, rows)
    splatted = holds_splats(scene)
    total = np.zeros((len(numbers), 3), dtype=np.float32)
    for sample, rays in enumerate(samples):
        alive = mi.Bool(~np.isnan(rays.direction).any(axis=-1))
        ray = _scene_rays(rays, placement)
        if splatted:
            radiance = splats.radiance(scene, ray, alive).radiance
        elif settings.samples == 1:
            radiance = whitted_radiance(scene, ray, settings.path_depth, alive)
        else:
            state, sequence = (mi.UInt64(word) for word in hashed(numbers, request.frame, sample, stream=1))
            random = mi.PCG32()
            random.seed(state, sequence)
            radiance = path_radiance(scene, ray, random, settings.path_depth, alive)
        total += _bounded(np.array(radiance, dtype=np.float32).T, settings.clamp)
    mean: Float32 = total / np.float32(settings.samples)
    return mean


def _bounded(radiance: Float32, clamp: float | None) -> Float32:
    """Return radiances without what is no number, and scaled so that no channel exceeds the clamp."""
    finite: Float32 = np.where(np.isfinite(radiance).all(axis=-1, keepdims=True), radiance, np.float32(0))
    if clamp is None:
        return finite
    most = finite.max(axis=-1, keepdims=True)
    bounded: Float32 = finite * np.minimum(np.float32(1), np.float32(clamp) / np.maximum(most, np.float32(1e-30)))
    return bounded


def _scene_rays(rays: Rays, placement: Placement) -> mi.Ray3f:
    """Return rays of the rig frame as rays of the scene; a dead one gets any direction."""
    start, direction = placement.points(rays.position), placement.directions(rays.direction)
    dead = np.isnan(direction).any(axis=-1)
    start[dead], direction[dead] = 0.0, (0.0, 0.0, 1.0)
    parts = [np.ascontiguousarray(part.T, dtype=np.float32) for part in (start, direction)]
    ray = mi.Ray3f(mi.Point3f(parts[0]), mi.Vector3f(parts[1]))
    dr.make_opaque(ray)
    return ray
