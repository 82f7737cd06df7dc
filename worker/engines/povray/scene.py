"""The text that POV-Ray is given: a job's scene, with the rig standing in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.job.resolved import JobSheet
from lippmann.job.stage import Stage
from lippmann.optics.lens.dispersion import povray_dispersion
from lippmann.optics.lens.surfaces import ImagingLens, Surface
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.method import Method
from povtemplates import literals, write
from worker.images.colour import decoded_srgb

TRACE_LEVEL = 24
"""Refractions and reflections a ray may meet: 2 + 6 surfaces of the paper's rig, and 10 to 21 in all were seen."""

BAFFLE_REACH = 20.0
"""Of a plate with a hole, in semi-apertures of the surface; farther where rays of the camera come out so far."""

RAYS_FILE = "lippmann-rays.inc"
"""What the text of a ray camera includes from beside itself."""

_ARRAY_MACROS = {"square": "Lippmann_Lens_Array_Square", "hexagonal": "Lippmann_Lens_Array_Hexagonal"}
_CAMERA_MACROS = {"orthographic": "Lippmann_Orthographic", "perspective": "Lippmann_Perspective"}


@dataclass(frozen=True)
class DepthPass:
    """A picture of distances instead of colours: see lippmann/depth.inc."""

    outside: tuple[float, float, float]
    """Where the first rays start, in units of the scene: inside no object."""
    cols: int
    """Of the picture."""
    near_mm: float
    """About the distances that matter most."""
    amplitude: float = 1.0


FAR = 50.0
"""How many times farther the second scale of distances reaches than the first."""


def pov_text(sheet: JobSheet, method: Method, *, depth: DepthPass | None = None) -> str:
    """Return the .pov text of a job at a frame: see `JobSheet.at`.

    Clock, tile and size are not in it: POV-Ray gets them on its command line. With the ray camera the rays are those
    of one tile, in `RAYS_FILE` beside it.
    """
    stood = bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm)
    modelled = stood.imaging_lens if method == "glass" else None
    surfaces = modelled.surfaces if modelled else ()
    return write.write_capture(
        title=f"Scene {sheet.spec.scene}",
        file=sheet.file.rpartition("/")[2],
        as_itself=sheet.file.lower().endswith(".pov"),
        parameters=[(name, _literal(value)) for name, value in sorted(sheet.parameters.items())],
        colours=any(isinstance(value, str) for value in sheet.parameters.values()),
        trace_level=TRACE_LEVEL + max(0, len(surfaces) - 6),
        surfaces=len(surfaces),
        numbers_a_surface=6,
        lens_rows=[_lens_row(surface, stood) for surface in surfaces],
        stop=_stop(modelled, stood),
        lens_array=_lens_array(stood),
        mla_z_mm=literals.number(stood.mla_z_mm),
        camera=_camera(stood),
        rays_file=RAYS_FILE if method == "ray_camera" else None,
        stage=_stage(sheet.stage),
        depth=_depth(depth, sheet.stage) if depth else None,
    )


def _literal(value: bool | int | float | str) -> str:
    """Return the SDL of a scene parameter: a number, a switch, or a colour '#rrggbb', which is sRGB."""
    if isinstance(value, bool):
        return literals.switch(value)
    if isinstance(value, str):
        return literals.colour(map(float, decoded_srgb(np.array([*bytes.fromhex(value[1:])]) / 255)))
    return literals.number(value)


def _depth(depth: DepthPass, stage: Stage) -> dict[str, str]:
    near = depth.near_mm / stage.mm_per_unit
    return {
        "outside": literals.vector(depth.outside),
        "count": literals.number(depth.cols),
        "amplitude": literals.number(depth.amplitude),
        "near": literals.number(near),
        "far": literals.number(FAR * near),
    }


def _lens_row(surface: Surface, stood: Bench) -> str:
    spread = povray_dispersion(surface.index_after, surface.abbe_after) if stood.rig.dispersion else 1.0
    radius_mm = 0 if math.isinf(surface.radius_mm) else surface.radius_mm
    return literals.numbers(
        (
            radius_mm,
            surface.thickness_mm,
            surface.index_after,
            surface.semi_aperture_mm,
            spread,
            _baffle_mm(surface.semi_aperture_mm, stood),
        )
    )


def _baffle_mm(semi_aperture_mm: float, stood: Bench) -> float:
    """Return how far a plate with a hole reaches from the axis: out to where no ray of the camera comes."""
    return max(BAFFLE_REACH * semi_aperture_mm, _rays_reach_mm(stood))


def _rays_reach_mm(stood: Bench) -> float:
    """Return how far from the axis rays of the camera come on their way from the array to the imaging lens.

    Twice the window's diagonal, and on the way to the lens twice what a lens of the array bends a ray, pitch by focal
    length.
    """
    array = stood.rig.lens_array
    slope = array.pitch_mm / array.focal_length_mm
    return 2 * (math.hypot(stood.width_mm, stood.height_mm) + abs(stood.mla_z_mm) * slope)


def _stop(lens: ImagingLens | None, stood: Bench) -> str | None:
    """Return place and radius of the stop's hole, and how far its plate reaches: as far as a baffle."""
    if lens is None or lens.stop is None:
        return None
    reach_mm = _baffle_mm(max(surface.semi_aperture_mm for surface in lens.surfaces), stood)
    return literals.numbers((lens.stop.z_mm, lens.stop.semi_aperture_mm, reach_mm))


def _lens_array(stood: Bench) -> str:
    array, shape = stood.rig.lens_array, stood.microlens
    arguments = literals.numbers((*array.count, array.pitch_mm, shape.radius_mm, shape.displacement_mm, array.index))
    return f"{_ARRAY_MACROS[array.lattice]}({arguments})"


def _camera(stood: Bench) -> str:
    distance_mm = stood.camera_z_mm - stood.mla_z_mm
    arguments = literals.numbers((stood.width_mm, stood.height_mm, stood.mla_z_mm, distance_mm))
    return f"{_CAMERA_MACROS[stood.rig.camera.projection]}({arguments})"


def _stage(stage: Stage) -> str:
    """Return the arguments of Lippmann_Stage."""
    return ", ".join(
        (
            literals.vector(stage.location),
            literals.vector(stage.look_at),
            literals.vector(stage.up),
            literals.number(stage.mm_per_unit),
        )
    )
