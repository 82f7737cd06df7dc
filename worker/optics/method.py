"""Which of the two roads a capture takes: glass that POV-Ray refracts in, or rays of the exact trace."""

from __future__ import annotations

from typing import Literal

from worker.errors import FieldProblem, OpticsError
from worker.job.spec import JobSpec
from worker.job.stage import Stage
from worker.optics.prescription import rig_lens
from worker.optics.surfaces import ImagingLens

Method = Literal["raytraced", "ray_camera"]

LEAST_GLASS_MM_PER_UNIT = 0.001
"""Below it glass was not exact any more (measured; a rig of kilometres in its scene's units)."""

LEAST_AIR_UNITS = 1e-4
"""Of the air between two surfaces: POV-Ray takes nearer ones for one (measured: 0.001 mm is right to 10 mm a unit)."""

LEAST_PITCH_UNITS = 0.005
"""Of the microlenses: smaller ones are missed (measured: pitch 1 mm is right to 300 mm a unit and fails at 500)."""


def capture_method(spec: JobSpec, stage: Stage) -> Method:
    """Return the road that a job takes.

    `auto` takes the ray camera, which costs less with any number of surfaces and agrees with glass to 50 dB and more
    (measured: docs/decisions/0008), but glass for what rays of one colour and one sample a pixel cannot do.

    Raises
    ------
    OpticsError
        If glass was asked for, or something that needs it, and it cannot be modelled.
    """
    asked, needs_glass = spec.capture.method, _field_that_needs_glass(spec)
    if asked == "ray_camera" or (asked == "auto" and needs_glass is None):
        return "ray_camera"
    obstacle = _obstacle_to_glass(spec, stage)
    if obstacle is None:
        return "raytraced"
    field = "capture.method" if asked == "raytraced" else str(needs_glass)
    expected = f"{'ray_camera' if asked == 'raytraced' else 'off'}, because {obstacle}"
    raise OpticsError.of([FieldProblem(field=field, expected=expected, got=asked if asked == "raytraced" else "on")])


def _obstacle_to_glass(spec: JobSpec, stage: Stage) -> str | None:
    lens = rig_lens(spec.rig)
    if lens is not None and not lens.is_spherical:
        return "rig.imaging_lens has aspheric surfaces, and glass is modelled with spherical ones"
    least, most = LEAST_GLASS_MM_PER_UNIT, _most_mm_per_unit(lens, spec.rig.lens_array.pitch_mm)
    if not least <= stage.mm_per_unit <= most:
        return (
            f"stage.mm_per_unit is {stage.mm_per_unit:g}, and POV-Ray's tolerances spoil glass of this rig outside "
            f"{least:g} to {most:g}"
        )
    return None


def _most_mm_per_unit(lens: ImagingLens | None, pitch_mm: float) -> float:
    """Return how small a rig may be built: up to where its narrowest air and its lenses are still seen."""
    inner = lens.surfaces[:-1] if lens else ()
    airs_mm = [surface.thickness_mm for surface in inner if surface.index_after == 1.0]
    return min([pitch_mm / LEAST_PITCH_UNITS, *(air_mm / LEAST_AIR_UNITS for air_mm in airs_mm)])


def _field_that_needs_glass(spec: JobSpec) -> str | None:
    if spec.render.antialias != "off":
        return "render.antialias"
    return "rig.dispersion" if spec.rig.dispersion else None
