"""The .pov text of a job: its scene with the rig in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.stage import Stage
from lippmann.optics.lens.dispersion import povray_dispersion
from lippmann.optics.lens.surfaces import ImagingLens, Surface
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.method import Method
from povtemplates import literals, write
from worker.images.colour import decoded_srgb

TRACE_LEVEL = 24
"""The limit of refractions and reflections of a ray: the paper's rig has 2 + 6 surfaces, and rays used 10 to 21."""

BAFFLE_REACH = 20.0
"""The least reach of a baffle, in semi-apertures of the surface; it reaches as far as the camera's rays."""

RAYS_FILE = "lippmann-rays.inc"
"""The include file of a ray camera, in the folder of the .pov."""

_ARRAY_MACROS = {"square": "Lippmann_Lens_Array_Square", "hexagonal": "Lippmann_Lens_Array_Hexagonal"}
_CAMERA_MACROS = {"orthographic": "Lippmann_Orthographic", "perspective": "Lippmann_Perspective"}


@dataclass(frozen=True)
class DepthPass:
    """A pass that renders distances instead of colours: see lippmann/depth.inc."""

    outside: tuple[float, float, float]
    """A point outside all objects, in units of the scene, at which the first rays start."""
    cols: int
    """The columns of the picture."""
    near_mm: float
    """The typical distance of the scene, the first of the two scales."""
    amplitude: float = 1.0


FAR = 50.0
"""The ratio of the second scale of distances to the first."""


def pov_text(sheet: ResolvedJob, method: Method, *, depth: DepthPass | None = None) -> str:
    """Return the .pov text of a job at a frame: see `ResolvedJob.at`.

    Clock, tile and size are not in the text: POV-Ray receives them on its command line. With the ray camera, the rays
    are those of one tile, in `RAYS_FILE` beside the .pov.
    """
    optical_bench = bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm)
    modelled = optical_bench.imaging_lens if method == "glass" else None
    surfaces = modelled.surfaces if modelled else ()
    return write.write_capture(
        title=f"Scene {sheet.spec.scene}",
        file=literals.file_name(sheet.file.rpartition("/")[2]),
        as_itself=sheet.file.lower().endswith(".pov"),
        parameters=parameter_literals(sheet),
        mirrored=sheet.stage.handedness == "right",
        colours=any(isinstance(value, str) for value in sheet.parameters.values()),
        trace_level=TRACE_LEVEL + max(0, len(surfaces) - 6),
        surfaces=len(surfaces),
        numbers_a_surface=6,
        dispersion_samples=sheet.spec.capture.bands if modelled and sheet.spec.rig.dispersion else None,
        lens_rows=[_lens_row(surface, optical_bench) for surface in surfaces],
        stop=_stop(modelled, optical_bench),
        lens_array=_lens_array(optical_bench),
        mla_z_mm=literals.number(optical_bench.mla_z_mm),
        camera=_camera(optical_bench),
        rays_file=RAYS_FILE if method == "ray_camera" else None,
        stage=_stage(sheet.stage),
        depth=_depth(depth, sheet.stage) if depth else None,
    )


def parameter_literals(sheet: ResolvedJob) -> list[tuple[str, str]]:
    """Return the names of the scene's parameters with their values as SDL."""
    return [(name, _literal(value)) for name, value in sorted(sheet.parameters.items())]


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


def _lens_row(surface: Surface, optical_bench: Bench) -> str:
    spread = povray_dispersion(surface.index_after, surface.abbe_after) if optical_bench.rig.dispersion else 1.0
    radius_mm = 0 if math.isinf(surface.radius_mm) else surface.radius_mm
    return literals.numbers(
        (
            radius_mm,
            surface.thickness_mm,
            surface.index_after,
            surface.semi_aperture_mm,
            spread,
            _baffle_mm(surface.semi_aperture_mm, optical_bench),
        )
    )


def _baffle_mm(semi_aperture_mm: float, optical_bench: Bench) -> float:
    """Return the reach of a baffle from the axis: it extends beyond all rays of the camera."""
    return max(BAFFLE_REACH * semi_aperture_mm, _rays_reach_mm(optical_bench))


def _rays_reach_mm(optical_bench: Bench) -> float:
    """Return the largest distance from the axis of the camera's rays between the array and the imaging lens.

    It is twice the window's diagonal plus twice the deflection by a lens of the array (pitch over focal length) on the
    way to the imaging lens.
    """
    array = optical_bench.rig.lens_array
    slope = array.pitch_mm / array.focal_length_mm
    return 2 * (math.hypot(optical_bench.width_mm, optical_bench.height_mm) + abs(optical_bench.mla_z_mm) * slope)


def _stop(lens: ImagingLens | None, optical_bench: Bench) -> str | None:
    """Return the place and radius of the stop's hole, and the reach of its plate, which is that of a baffle."""
    if lens is None or lens.stop is None:
        return None
    reach_mm = _baffle_mm(max(surface.semi_aperture_mm for surface in lens.surfaces), optical_bench)
    return literals.numbers((lens.stop.z_mm, lens.stop.semi_aperture_mm, reach_mm))


def _lens_array(optical_bench: Bench) -> str:
    array, shape = optical_bench.rig.lens_array, optical_bench.microlens
    arguments = literals.numbers((*array.count, array.pitch_mm, shape.radius_mm, shape.displacement_mm, array.index))
    return f"{_ARRAY_MACROS[array.lattice]}({arguments})"


def _camera(optical_bench: Bench) -> str:
    distance_mm = optical_bench.camera_z_mm - optical_bench.mla_z_mm
    arguments = literals.numbers((optical_bench.width_mm, optical_bench.height_mm, optical_bench.mla_z_mm, distance_mm))
    return f"{_CAMERA_MACROS[optical_bench.rig.camera.projection]}({arguments})"


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
