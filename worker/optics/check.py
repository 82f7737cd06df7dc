"""Whether a job's optics can be, and what its maker should know before anything is rendered."""

from __future__ import annotations

import math

from worker.errors import FieldProblem, OpticsError
from worker.job.scene import Stage
from worker.job.spec import JobSpec
from worker.optics.capture import Bench, bench
from worker.optics.matrices import cardinal_points, conjugate


def check_rig(spec: JobSpec, stage: Stage) -> tuple[str, ...]:
    """Return notes on the optics of a job; what is allowed but worth saying.

    Raises
    ------
    OpticsError
        If they cannot be built: a lens wider than its sphere, the array inside the imaging lens, no real image.
    """
    _check_real_image(spec, stage)
    stood = bench(spec.rig, reference_mm=stage.reference_mm)
    _check_behind_lens(stood)
    return (*_image_space_notes(stood, stage), *_f_number_notes(stood))


def _check_real_image(spec: JobSpec, stage: Stage) -> None:
    lens = bench(spec.rig, reference_mm=stage.reference_mm).imaging_lens
    image_mm = conjugate(lens, stage.reference_mm).image_mm
    if not (math.isfinite(image_mm) and image_mm > 0):
        raise OpticsError.of(
            [
                FieldProblem(
                    field="stage.reference_mm",
                    expected="a reference plane that the imaging lens images behind itself",
                    got=f"{stage.reference_mm:g} mm, imaged at {image_mm:.4g} mm",
                )
            ]
        )


def _check_behind_lens(stood: Bench) -> None:
    if stood.mla_behind_lens_mm <= 0:
        offset_mm = stood.rig.lens_array.offset_mm
        raise OpticsError.of(
            [
                FieldProblem(
                    field="rig.lens_array.offset_mm",
                    expected=f"below {stood.mla_behind_lens_mm + offset_mm:.4g} mm, so that the array stands behind "
                    "the imaging lens",
                    got=f"{offset_mm:g} mm",
                )
            ]
        )


def _image_space_notes(stood: Bench, stage: Stage) -> tuple[str, ...]:
    near_mm = conjugate(stood.imaging_lens, stage.near_mm).image_mm - stood.mla_behind_lens_mm
    far_mm = conjugate(stood.imaging_lens, stage.far_mm).image_mm - stood.mla_behind_lens_mm
    depth = f"s from {far_mm:+.1f} mm (far) to {near_mm:+.1f} mm (near)"
    if far_mm >= 0:
        return (f"The array stands outside the image space, on the lens's side: all is shown real, {depth}.",)
    if near_mm <= 0:
        return (f"The array stands outside the image space, on the camera's side: all is shown virtual, {depth}.",)
    return (f"The array stands in the image space: near parts are shown real, far ones virtual, {depth}.",)


def _f_number_notes(stood: Bench) -> tuple[str, ...]:
    lens, array = stood.imaging_lens, stood.rig.lens_array
    focal_mm = cardinal_points(lens).effective_focal_length_mm
    lens_f_number = focal_mm / (2 * lens.semi_aperture_mm)
    mla_f_number = array.focal_length_mm / array.pitch_mm
    if lens_f_number <= mla_f_number:
        return ()
    return (
        f"The imaging lens (f/{lens_f_number:.2g}) is slower than the array (f/{mla_f_number:.2g}): "
        "pixels at the edge of every cell stay dark.",
    )
