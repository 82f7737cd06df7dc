"""The capture method of a job: refractive geometry in POV-Ray (glass), or the ray camera of the exact trace."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Literal

from lippmann.errors import FieldProblem, OpticsError
from lippmann.job.optics.rig import LensArray
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.optics.lens.prescription import rig_lens
from lippmann.optics.lens.stop import stop_space
from lippmann.optics.lens.surfaces import CONTACT_GAP_MM, ImagingLens
from lippmann.optics.rig.microlens import microlens

Method = Literal["glass", "ray_camera"]

LEAST_GLASS_MM_PER_UNIT = 0.001
"""The least scale at which refractive geometry is exact (measured)."""

LEAST_GAP_UNITS = 1e-4
"""The least gap between two surfaces: POV-Ray treats closer ones as one (measured: 0.001 mm of air is correct up to 10
mm per unit)."""

LEAST_LENS_UNITS = 6e-4
"""The least thickness of the microlenses: POV-Ray misses the glass of flatter ones (measured at 8 px per lens, pitch
1 and 0.2 mm: 6.4e-4 is correct, below 5.1e-4 pixels in the corners are wrong, and at 1.3e-4 most are)."""

OVERLAP_MM = 0.02
OVERLAP_FRACTION = 0.37
"""Cemented elements overlap by the first number, but at most by this fraction of the thinner one, as in
lippmann/imaging_lens.inc."""

BAFFLE_GAP_FRACTION = 0.4
"""A baffle is moved by at most this fraction of the distance to the neighbouring surface, as in
lippmann/imaging_lens.inc."""

LEAST_PITCH_UNITS = 0.005
"""The least pitch of the microlenses: POV-Ray misses smaller ones (measured: a pitch of 1 mm is correct up to
300 mm per unit and fails at 500)."""


def capture_method(spec: JobSpec, stage: Stage) -> Method:
    """Return the capture method of a job.

    `auto` selects the ray camera, which costs less with any number of surfaces and agrees with refractive geometry to
    50 dB and more (measured: docs/decisions/0008). It selects refractive geometry for antialiasing, which needs rays
    between pixels.

    Parameters
    ----------
    spec
        The job without keyframes.
    stage
        The stage of the scene.

    Raises
    ------
    OpticsError
        If the job requires refractive geometry and POV-Ray cannot model it.
    """
    asked = spec.capture.method
    if asked == "ray_camera" or (asked == "auto" and spec.render.antialias == "off"):
        return "ray_camera"
    obstacle = _obstacle_to_glass(spec, stage)
    if obstacle is None:
        return "glass"
    field = "capture.method" if asked == "glass" else "render.antialias"
    expected = f"{'ray_camera' if asked == 'glass' else 'off'}, because {obstacle}"
    raise OpticsError.of([FieldProblem(field=field, expected=expected, got=asked if asked == "glass" else "on")])


def _obstacle_to_glass(spec: JobSpec, stage: Stage) -> str | None:
    lens = rig_lens(spec.rig)
    if lens is not None and not lens.is_spherical:
        return "rig.imaging_lens has aspheric surfaces, and glass is modelled with spherical ones"
    least, most = LEAST_GLASS_MM_PER_UNIT, _most_mm_per_unit(lens, spec.rig.lens_array)
    if not least <= stage.mm_per_unit <= most:
        return (
            f"stage.mm_per_unit is {stage.mm_per_unit:g}, and POV-Ray's tolerances spoil glass of this rig outside "
            f"{least:g} to {most:g}"
        )
    return None


def _most_mm_per_unit(lens: ImagingLens | None, array: LensArray) -> float:
    """Return the least scale of a rig at which POV-Ray still finds its narrowest gap and its lenses."""
    lenses = array.pitch_mm / LEAST_PITCH_UNITS, microlens(array).thickness_mm / LEAST_LENS_UNITS
    return min(*lenses, *(gap_mm / LEAST_GAP_UNITS for gap_mm in (_gaps_mm(lens) if lens else ())))


def _gaps_mm(lens: ImagingLens) -> Iterator[float]:
    """Yield the gaps in the model of a lens: between surfaces, cemented elements, and plates and planes."""
    media = [surface.index_after for surface in lens.surfaces]
    thicknesses = [surface.thickness_mm for surface in lens.surfaces[:-1]]
    yield from thicknesses
    for place, pair in enumerate(pairwise(thicknesses)):
        if media[place] != 1.0 and media[place + 1] != 1.0:
            yield min(OVERLAP_MM, OVERLAP_FRACTION * min(pair))
    for place, surface in enumerate(lens.surfaces):
        beside = lens.surfaces[max(0, place - 1) : place + 2]
        if surface.is_flat and any(one.semi_aperture_mm > surface.semi_aperture_mm for one in beside):
            outside = [] if 0 < place < len(thicknesses) else [math.inf]
            yield min(
                CONTACT_GAP_MM,
                BAFFLE_GAP_FRACTION * max(outside + thicknesses[max(0, place - 1) : place + 1]),
            )
    if lens.stop is not None:
        behind = stop_space(lens, lens.stop)
        for place in range(max(0, behind - 1), min(behind + 1, len(lens.surfaces))):
            if lens.surfaces[place].is_flat:
                yield abs(lens.vertices_mm[place] - lens.stop.z_mm)
