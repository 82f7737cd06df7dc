"""The text that POV-Ray is given: a job's scene, with the rig standing in it."""

from __future__ import annotations

import math

from povtemplates import literals, write
from worker.job.sheet import JobSheet
from worker.optics.capture import Bench, bench

TRACE_LEVEL = 24
"""Refractions and reflections a ray may meet: 2 + 6 surfaces of the paper's rig, and 10 to 21 in all were seen."""


def pov_text(sheet: JobSheet) -> str:
    """Return the .pov text of a job.

    Frame, tile and size are not in it: POV-Ray gets them on its command line.
    """
    stood = bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm)
    stage = sheet.stage
    surfaces = stood.imaging_lens.surfaces
    return write.write_capture(
        title=f"Scene {sheet.spec.scene}",
        parameters=[(name, literals.parameter(value)) for name, value in sorted(sheet.parameters.items())],
        trace_level=TRACE_LEVEL + max(0, len(surfaces) - 6),
        surfaces=len(surfaces),
        lens_rows=[
            literals.numbers(
                (
                    0 if math.isinf(surface.radius_mm) else surface.radius_mm,
                    surface.thickness_mm,
                    surface.index_after,
                    surface.semi_aperture_mm,
                )
            )
            for surface in surfaces
        ],
        lens_array=_lens_array(stood),
        mla_z_mm=literals.number(stood.mla_z_mm),
        camera=_camera(stood),
        stage=", ".join(
            (
                literals.vector(stage.location),
                literals.vector(stage.look_at),
                literals.vector(stage.up),
                literals.number(stage.mm_per_unit),
            )
        ),
    )


def _lens_array(stood: Bench) -> str:
    array, shape = stood.rig.lens_array, stood.microlens
    return literals.numbers((*array.count, array.pitch_mm, shape.radius_mm, shape.displacement_mm, array.index))


def _camera(stood: Bench) -> str:
    macro = {"orthographic": "Lippmann_Orthographic", "perspective": "Lippmann_Perspective"}
    distance_mm = stood.camera_z_mm - stood.mla_z_mm
    arguments = literals.numbers((stood.width_mm, stood.height_mm, stood.mla_z_mm, distance_mm))
    return f"{macro[stood.rig.camera.projection]}({arguments})"
