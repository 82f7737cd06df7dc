"""Compute the design of a job from its optics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.optics.rig import Rig
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.optics.drawing.diagram import draw_bench
from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.lens.prescription import chosen_lens
from lippmann.optics.lens.stop import with_stop
from lippmann.optics.rig.bench import Bench, bench, camera_distance_mm, perspective_distance_mm
from lippmann.optics.rig.check import check_job, check_rig, place_in_image_space
from lippmann.optics.rig.disparity import exact_disparity, small_angle_disparity
from lippmann.optics.rig.method import capture_method
from lippmann.optics.rig.spots import working_f_number
from lippmann.plan.design import notes as design_words
from lippmann.plan.design.design import Design
from lippmann.plan.design.display import device_numbers, display_numbers
from lippmann.plan.design.estimate import MEASURED_ON, estimate
from lippmann.plan.design.lens import ended, lens_numbers
from lippmann.plan.sampling import display_size, frame_size


def design(sheet: ResolvedJob, *, frame: int | None = None) -> Design:
    """Return the design of a job at a frame, by default the first one.

    Raises
    ------
    OpticsError, SpecError
        As for `lippmann.optics.rig.check.check_job`: a rig that cannot be built has no design. A job of imported
        integral images has none either, because its optics are unknown.
    """
    _check_rendered(sheet)
    check_job(sheet)
    frame = sheet.spec.frame_numbers[0] if frame is None else frame
    there = sheet.at(frame)
    spec, stage = there.spec, there.stage
    place_words, *notes = check_rig(spec, stage)
    optical_bench = bench_as_written(spec.rig, stage)
    numbers: dict[str, Any] = {
        **lens_numbers(optical_bench, stage),
        **_array_numbers(optical_bench, stage, place_words),
        **_pixel_numbers(spec, stage),
        **device_numbers(spec.rig),
        **display_numbers(spec, optical_bench, stage),
        **_cost_numbers(sheet.spec, spec, stage),
    }
    warnings = (*notes, *design_words.warnings(spec, stage, numbers))
    shown = {name: ended(value) for name, value in numbers.items()}
    return Design(scene=spec.scene, title=spec.title, frame=frame, warnings=warnings, **shown)


def drawing(sheet: ResolvedJob, *, frame: int | None = None) -> str:
    """Return the drawing of a job's optics at a frame, by default the first one, as SVG.

    Raises
    ------
    OpticsError, SpecError
        See `design`.
    """
    _check_rendered(sheet)
    check_job(sheet)
    there = sheet.at(sheet.spec.frame_numbers[0] if frame is None else frame)
    optical_bench = bench_as_written(there.spec.rig, there.stage)
    return draw_bench(optical_bench, there.stage, title=there.spec.title or there.spec.scene)


def bench_as_written(rig: Rig, stage: Stage) -> Bench:
    """Return the optics with touching surfaces, as in the prescription; the model separates them."""
    built = bench(rig, reference_mm=stage.reference_mm)
    if rig.imaging_lens is None:
        return built
    lens = with_stop(chosen_lens(rig.imaging_lens), rig)
    image_mm = conjugate(lens, stage.reference_mm).image_mm
    mla_z_mm = lens.length_mm + image_mm - rig.lens_array.offset_mm
    return replace(built, imaging_lens=lens, mla_z_mm=mla_z_mm, camera_z_mm=mla_z_mm + camera_distance_mm(rig))


def _check_rendered(sheet: ResolvedJob) -> None:
    if sheet.sheets is not None:
        expected = "a scene that is rendered: a design describes a capture"
        got = f"{sheet.spec.scene!r}, a bundle of imported integral images, which has no design"
        raise SpecError.of([FieldProblem("scene", expected=expected, got=got)])


def _array_numbers(optical_bench: Bench, stage: Stage, place_words: str) -> dict[str, Any]:
    array, shape, rig = optical_bench.rig.lens_array, optical_bench.microlens, optical_bench.rig
    near_mm, reference_mm, far_mm = map(optical_bench.s_mm, (stage.near_mm, stage.reference_mm, stage.far_mm))
    return {
        "lens_radius_mm": shape.radius_mm,
        "displacement_mm": shape.displacement_mm,
        "lens_thickness_mm": shape.thickness_mm,
        "mla_f_number": array.focal_length_mm / array.pitch_mm,
        "f_number_match": design_words.f_number_match(
            optical_bench, working_f_number(optical_bench, stage.reference_mm)
        ),
        "mla_behind_lens_mm": optical_bench.mla_behind_lens_mm if optical_bench.imaging_lens else None,
        "mla_place": place_in_image_space(near_mm, far_mm),
        "mla_place_words": place_words,
        "s_near_mm": near_mm,
        "s_reference_mm": reference_mm,
        "s_far_mm": far_mm,
        "disparity_near": small_angle_disparity(optical_bench, stage.near_mm),
        "disparity_far": small_angle_disparity(optical_bench, stage.far_mm),
        "exact_disparity_near": exact_disparity(optical_bench, stage.near_mm),
        "exact_disparity_far": exact_disparity(optical_bench, stage.far_mm),
        "projection": rig.camera.projection,
        "camera_distance_mm": perspective_distance_mm(rig),
        "camera_angle_deg": rig.camera.angle_deg,
    }


def _pixel_numbers(spec: JobSpec, stage: Stage) -> dict[str, Any]:
    size, shown = frame_size(spec.rig), display_size(spec.rig)
    view_rows_px, view_cols_px = shown.square_size()
    return {
        "rows_px": size.rows,
        "cols_px": size.cols,
        "lens_rows": size.lens_rows,
        "lens_cols": size.lens_cols,
        "px_per_lens": size.px_per_lens,
        "views": int(shown.mask.sum()),
        "view_rows_px": view_rows_px,
        "view_cols_px": view_cols_px,
        "capture_method": capture_method(spec, stage),
    }


def _cost_numbers(asked: JobSpec, there: JobSpec, stage: Stage) -> dict[str, Any]:
    found = estimate(asked, capture_method(there, stage))
    return {
        "frames": found.frames,
        "sheet_mb": found.sheet_mb,
        "memory_mb": found.memory_mb,
        "frame_cpu_s": found.frame_cpu_s,
        "cpu_s": found.cpu_s,
        "measured_on": MEASURED_ON,
    }
