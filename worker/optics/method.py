"""Which of the two roads a capture takes: glass that POV-Ray refracts in, or rays of the exact trace."""

from __future__ import annotations

from typing import Literal

from worker.errors import FieldProblem, OpticsError
from worker.job.scene import Stage
from worker.job.spec import JobSpec
from worker.optics.prescription import rig_lens

Method = Literal["raytraced", "ray_camera"]

GLASS_MM_PER_UNIT = (0.3, 30.0)
"""Scales at which POV-Ray's own tolerances leave modelled glass exact (measured: docs/scenes.md)."""


def capture_method(spec: JobSpec, stage: Stage) -> Method:
    """Return the road that a job takes.

    `auto` takes modelled glass, which is cheaper with few surfaces (measured: docs/decisions), and the ray camera for
    optics that glass cannot build.

    Raises
    ------
    OpticsError
        If glass was asked for, or something that needs it, and it cannot be modelled.
    """
    asked, obstacle, needs_glass = spec.capture.method, _obstacle_to_glass(spec, stage), _field_that_needs_glass(spec)
    if asked == "ray_camera":
        return "ray_camera"
    if obstacle is None:
        return "raytraced"
    if asked == "auto" and needs_glass is None:
        return "ray_camera"
    field = "capture.method" if asked == "raytraced" else str(needs_glass)
    expected = f"{'ray_camera' if asked == 'raytraced' else 'off'}, because {obstacle}"
    raise OpticsError.of([FieldProblem(field=field, expected=expected, got=asked if asked == "raytraced" else "on")])


def _obstacle_to_glass(spec: JobSpec, stage: Stage) -> str | None:
    lens = rig_lens(spec.rig)
    if lens is not None and not lens.is_spherical:
        return "rig.imaging_lens has aspheric surfaces, and glass is modelled with spherical ones"
    least, most = GLASS_MM_PER_UNIT
    if not least <= stage.mm_per_unit <= most:
        return f"stage.mm_per_unit is {stage.mm_per_unit:g}, and POV-Ray's tolerances spoil glass beyond {least:g} to {most:g}"
    return None


def _field_that_needs_glass(spec: JobSpec) -> str | None:
    if spec.render.antialias != "off":
        return "render.antialias"
    return "rig.dispersion" if spec.rig.dispersion else None
