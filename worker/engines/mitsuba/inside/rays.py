"""The rays of the samples of pixels, from the exact trace into the units of a scene, on the arrays of the engine.

Samples lie inside their pixel and under the lens of the pixel's centre, so that no light of a neighbouring lens gets
into a cell. The place of a sample depends on the frame, the pixel and the number of the sample alone, not on the tile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.job.scenes.stage import Stage
from lippmann.optics.lens.ray import Ray
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench, object_ray, pixel_centres_mm
from lippmann.optics.rig.to_scene import rig_to_scene
from worker.engines.mitsuba.inside.arrays import DrJitArrays
from worker.engines.mitsuba.inside.messages import Request

REDRAWS = 8
"""The places that are tried for a sample that lies under another lens than its pixel; the last is the centre."""


@dataclass(frozen=True)
class Placement:
    """The map from the rig frame in mm to the units of a scene."""

    matrix: list[list[Any]]
    """The rows of `rig_to_scene`, each number a `mi.Float64` that is no constant of compiled code."""
    mm_per_unit: float

    @classmethod
    def of(cls, stage: Stage) -> Placement:
        """Return the placement of a stage in a scene, whose axes are right-handed unless the stage says left."""
        rows = [[float(value) for value in row] for row in rig_to_scene(stage, auto="right")]
        return cls([[dr.opaque(mi.Float64, value) for value in row] for row in rows], stage.mm_per_unit)

    def ray(self, ray: Ray) -> mi.Ray3f:
        """Return rays of the rig frame as rays of the scene."""
        x, y, z = (mi.Float64(part) for part in ray.position)
        dx, dy, dz = (mi.Float64(part) * self.mm_per_unit for part in ray.direction)
        start = [row[0] * x + row[1] * y + row[2] * z + row[3] for row in self.matrix[:3]]
        ahead = [row[0] * dx + row[1] * dy + row[2] * dz for row in self.matrix[:3]]
        return mi.Ray3f(mi.Point3f(*map(mi.Float, start)), mi.Vector3f(*map(mi.Float, ahead)))

    def rig_direction(self, vector: Any) -> Any:
        """Return directions of the scene, `mi.Vector3f`, in the rig frame."""
        columns = ([mi.Float(row[k]) * self.mm_per_unit for row in self.matrix[:3]] for k in range(3))
        return mi.Vector3f(*(c[0] * vector.x + c[1] * vector.y + c[2] * vector.z for c in columns))


@dataclass(frozen=True)
class Pixels:
    """Some rows of the region of a request."""

    numbers: Any
    """The numbers of the pixels in the whole picture, `mi.UInt32` of (row * col)."""
    x_mm: Any
    y_mm: Any
    """The centres of the pixels on the MLA plane, `mi.Float64`, mm."""

    @classmethod
    def of(cls, bench: Bench, request: Request, rows: range) -> Pixels:
        """Return the pixels of rows of the whole picture."""
        _, _, col_start, col_stop = request.region
        region = slice(rows.start, rows.stop), slice(col_start, col_stop)
        centres = pixel_centres_mm(bench, rows=request.rows, cols=request.cols, region=region).reshape(-1, 2)
        index = dr.arange(mi.UInt32, len(centres))
        width, start = dr.opaque(mi.UInt32, col_stop - col_start), dr.opaque(mi.UInt32, rows.start)
        row = index // width
        numbers = (row + start) * request.cols + (index - row * width) + dr.opaque(mi.UInt32, col_start)
        pixels = cls(numbers, mi.Float64(centres[:, 0]), mi.Float64(centres[:, 1]))
        dr.eval(pixels.numbers, pixels.x_mm, pixels.y_mm)
        return pixels

    def rays(self, bench: Bench) -> Ray:
        """Return the rays of the centres of the pixels in the rig frame, NaN where one is dead."""
        return _traced(bench, self.x_mm, self.y_mm)

    def sample_rays(self, bench: Bench, request: Request, sample: int) -> Ray:
        """Return the rays of one sample of each pixel in the rig frame, NaN where one is dead."""
        return _traced(bench, *self.sample_places(bench, request, sample))

    def sample_places(self, bench: Bench, request: Request, sample: int) -> tuple[Any, Any]:
        """Return the places of one sample of each pixel on the MLA plane, `mi.Float64` x and y, mm.

        The only sample lies at the centre. Several are points of Hammersley's set, moved round in the pixel by an
        offset of the pixel.
        """
        samples = request.job.spec.render.samples
        if samples == 1:
            return self.x_mm, self.y_mm
        point = ((sample + 0.5) / samples, _radical_inverse(sample))
        offset = self.fractions(request.frame, 0, stream=0)
        right, down = (dr.opaque(mi.Float64, at) + shift for at, shift in zip(point, offset, strict=True))
        x, y = self._place(bench, request, right - dr.floor(right), down - dr.floor(down))
        if not bench.rig.layout.interlocks:
            return x, y
        xp, array = DrJitArrays(), bench.rig.lens_array
        own = lattice.nearest_centre(array, self.x_mm, self.y_mm, xp=xp)
        for redraw in range(1, REDRAWS + 1):
            under = lattice.nearest_centre(array, x, y, xp=xp)
            other = (under[0] != own[0]) | (under[1] != own[1])
            drawn = self._place(bench, request, *self.fractions(request.frame, sample, stream=16 + redraw))
            instead = (self.x_mm, self.y_mm) if redraw == REDRAWS else drawn
            x, y = dr.select(other, instead[0], x), dr.select(other, instead[1], y)
        return x, y

    def _place(self, bench: Bench, request: Request, right: Any, down: Any) -> tuple[Any, Any]:
        """Return places in the pixels, given from 0 to 1, on the MLA plane."""
        width_mm, height_mm = bench.width_mm / request.cols, bench.height_mm / request.rows
        return self.x_mm + (right - 0.5) * width_mm, self.y_mm - (down - 0.5) * height_mm

    def fractions(self, frame: int, sample: int, *, stream: int) -> tuple[Any, Any]:
        """Return two random numbers of each pixel between 0 and 1, both exclusive, `mi.Float64`."""
        one, other = ((mi.Float64(word) + 0.5) / 2.0**32 for word in self.words(frame, sample, stream=stream))
        return one, other

    def words(self, frame: int, sample: int, *, stream: int) -> tuple[Any, Any]:
        """Return two random words of each pixel, `mi.UInt32`, which depend on these numbers alone.

        The hash is PCG3D (Jarzynski and Olano, Hash functions for GPU rendering, JCGT 9(3), 2020).

        Parameters
        ----------
        frame
            The number of the frame.
        sample
            The number of the sample.
        stream
            What the words are for.
        """
        given = self.numbers, dr.opaque(mi.UInt32, frame), dr.opaque(mi.UInt32, sample * 64 + stream)
        x, y, z = (number * 1664525 + 1013904223 for number in given)
        x, y, z = _mixed(x, y, z)
        x, y, z = x ^ (x >> 16), y ^ (y >> 16), z ^ (z >> 16)
        x, y, z = _mixed(x, y, z)
        return x, y


def _mixed(x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    x = x + y * z
    y = y + z * x
    z = z + x * y
    return x, y, z


def _traced(bench: Bench, x_mm: Any, y_mm: Any) -> Ray:
    """Trace points of the MLA plane; a kernel of its own, so that scenes are not compiled again with every rig."""
    ray = object_ray(bench, x_mm, y_mm, xp=DrJitArrays())
    dr.eval(ray.position, ray.direction)
    return ray


def _radical_inverse(number: int) -> float:
    """Return the binary digits of a number mirrored at the point.

    >>> [_radical_inverse(number) for number in range(4)]
    [0.0, 0.5, 0.25, 0.75]
    """
    digits = f"{number:b}"[::-1]
    return math.ldexp(int(digits, 2), -len(digits))
