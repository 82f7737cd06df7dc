"""The rays of the samples of pixels, from the exact trace into the units of a scene.

Samples lie inside their pixel and under the lens of the pixel's centre, so that no light of a neighbouring lens gets
into a cell. The place of a sample depends on the frame, the pixel and the number of the sample alone, not on the tile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.job.stage import Stage
from lippmann.optics.lens.ray import Ray, Vector
from lippmann.optics.lens.trace import Rays
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench, object_ray, pixel_centres_mm
from lippmann.optics.rig.to_scene import rig_axes
from worker.engines.mitsuba.inside.arrays import DrJitArrays
from worker.engines.mitsuba.inside.messages import Request

REDRAWS = 8
"""The places that are tried for a sample that lies under another lens than its pixel; the last is the centre."""

Array = NDArray[np.float64]
Words = NDArray[np.uint32]


@dataclass(frozen=True)
class Placement:
    """The map from the rig frame in mm to the units of a scene: p -> axes @ p / mm_per_unit + origin."""

    axes: Array
    """The directions x, y, z of the rig frame in the scene as columns, (3, 3), orthonormal."""
    origin: Array
    """The vertex of surface 1 in scene units, (3,)."""
    mm_per_unit: float

    @classmethod
    def of(cls, stage: Stage) -> Placement:
        """Return the placement of a stage in a scene whose axes are right-handed unless the stage says left.

        The axes are those of the macro Lippmann_Stage of POV-Ray; see `rig_axes`.
        """
        return cls(rig_axes(stage, auto="right"), np.array(stage.location, dtype=float), stage.mm_per_unit)

    def points(self, points_mm: Array) -> Array:
        """Return points (..., 3) of the rig frame, mm, in scene units."""
        return self.directions(points_mm) / self.mm_per_unit + self.origin

    def directions(self, directions: Array) -> Array:
        """Return directions (..., 3) of the rig frame in the scene."""
        return _turned(directions, self.axes)

    def rig_directions(self, directions: NDArray[np.floating]) -> Array:
        """Return directions (..., 3) of the scene in the rig frame."""
        return _turned(directions.astype(np.float64), self.axes.T)


def _turned(vectors: Array, axes: Array) -> Array:
    """Return axes @ vector for vectors (..., 3), by sums of three that do not depend on how many there are."""
    x, y, z = (vectors[..., k, np.newaxis] for k in range(3))
    turned: Array = x * axes[:, 0] + y * axes[:, 1] + z * axes[:, 2]
    return turned


def pixel_numbers(request: Request, rows: range) -> Words:
    """Return the numbers of the pixels of some rows of the region in the whole picture, (row * col) uint32."""
    _, _, col_start, col_stop = request.region
    cols = np.arange(col_start, col_stop, dtype=np.uint32)
    numbers = np.arange(rows.start, rows.stop, dtype=np.uint32)[:, np.newaxis] * np.uint32(request.cols) + cols
    flat: Words = numbers.reshape(-1)
    return flat


def centre_rays(bench: Bench, request: Request, rows: range) -> Rays:
    """Return the rays of the centres of the pixels of some rows of the region, each array (pixel, 3), rig frame."""
    return _traced(bench, _centres(bench, request, rows))


def sample_rays(bench: Bench, request: Request, rows: range, sample: int) -> Rays:
    """Return the rays of one sample of the pixels of some rows of the region, each array (pixel, 3), rig frame.

    Parameters
    ----------
    bench
        The bench of the rig.
    request
        The request, whose job has the number of samples of a pixel.
    rows
        The rows of the whole picture.
    sample
        The number of the sample from 0.
    """
    return _traced(bench, sample_points_mm(bench, request, rows, sample))


def _traced(bench: Bench, points_mm: Array) -> Rays:
    """Trace points (pixel, 2) inside the engine."""
    ray = object_ray(bench, mi.Float64(points_mm[:, 0]), mi.Float64(points_mm[:, 1]), xp=DrJitArrays())
    dr.eval(ray.position, ray.direction)
    return Rays.of(Ray(_numpy(ray.position), _numpy(ray.direction)))


def _numpy(vector: Vector) -> Vector:
    x, y, z = (np.array(part) for part in vector)
    return x, y, z


def sample_points_mm(bench: Bench, request: Request, rows: range, sample: int) -> Array:
    """Return the places of one sample of the pixels of some rows on the MLA plane, (pixel, 2), mm as (x, y)."""
    centres = _centres(bench, request, rows)
    samples = request.job.spec.render.samples
    if samples == 1:
        return centres
    numbers = pixel_numbers(request, rows)
    across = np.array([bench.width_mm / request.cols, -bench.height_mm / request.rows])
    points: Array = centres + (_stratified(numbers, request.frame, sample, samples) - 0.5) * across
    if not bench.rig.layout.interlocks:
        return points
    array = bench.rig.lens_array
    own = lattice.nearest_centre_mm(array, centres)
    for redraw in range(1, REDRAWS + 1):
        other = np.flatnonzero((lattice.nearest_centre_mm(array, points) != own).any(axis=-1))
        if not len(other):
            break
        if redraw == REDRAWS:
            points[other] = centres[other]
        else:
            drawn = _fractions(hashed(numbers[other], request.frame, sample, stream=16 + redraw))
            points[other] = centres[other] + (drawn - 0.5) * across
    return points


def _centres(bench: Bench, request: Request, rows: range) -> Array:
    _, _, col_start, col_stop = request.region
    region = slice(rows.start, rows.stop), slice(col_start, col_stop)
    return pixel_centres_mm(bench, rows=request.rows, cols=request.cols, region=region).reshape(-1, 2)


def _stratified(numbers: Words, frame: int, sample: int, samples: int) -> Array:
    """Return places in the unit square, (pixel, 2): points of Hammersley's set, moved round by an offset per pixel."""
    point = np.array([(sample + 0.5) / samples, _radical_inverse(sample)])
    moved: Array = (point + _fractions(hashed(numbers, frame, 0, stream=0))) % 1.0
    return moved


def _radical_inverse(number: int) -> float:
    """Return the binary digits of a number mirrored at the point.

    >>> [_radical_inverse(number) for number in range(4)]
    [0.0, 0.5, 0.25, 0.75]
    """
    digits = f"{number:b}"[::-1]
    return math.ldexp(int(digits, 2), -len(digits))


def _fractions(words: tuple[Words, Words]) -> Array:
    """Return two words of each pixel as numbers between 0 and 1, both exclusive, (pixel, 2)."""
    fractions: Array = (np.stack(words, axis=-1).astype(np.float64) + 0.5) / 2.0**32
    return fractions


def hashed(numbers: Words, frame: int, sample: int, *, stream: int) -> tuple[Words, Words]:
    """Return two random words for every pixel, which depend on these numbers alone.

    The hash is PCG3D (Jarzynski and Olano, Hash functions for GPU rendering, JCGT 9(3), 2020).

    Parameters
    ----------
    numbers
        The numbers of the pixels in the whole picture, uint32.
    frame
        The number of the frame.
    sample
        The number of the sample.
    stream
        What the words are for.
    """
    factor, step, half = np.uint32(1664525), np.uint32(1013904223), np.uint32(16)
    x = numbers * factor + step
    y = np.full_like(x, (frame * 1664525 + 1013904223) % 2**32)
    z = np.full_like(x, ((sample * 64 + stream) * 1664525 + 1013904223) % 2**32)
    for rounds in range(2):
        x += y * z
        y += z * x
        z += x * y
        if rounds == 0:
            x ^= x >> half
            y ^= y >> half
            z ^= z >> half
    return x, y
