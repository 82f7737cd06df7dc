"""Checks of a job's optics, and notes on them before anything is rendered."""

from __future__ import annotations

import math

from lippmann.errors import FieldProblem, OpticsError, SpecError
from lippmann.job.optics.rig import MAX_FRAME_PX
from lippmann.job.resolved import ResolvedJob, add_frame
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.optics.lens.stop import f_number
from lippmann.optics.rig.array import extent_mm
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.method import capture_method

_MEASURED = ", s from "
"""The words after which the numbers of a note follow."""


def check_job(sheet: ResolvedJob) -> tuple[str, ...]:
    """Return notes on the optics of a job, at every frame at which it is validated.

    Raises
    ------
    OpticsError
        As `check_rig`; the message names the frame.
    """
    if sheet.sheets is not None:
        _check_window(bench(sheet.spec.rig, reference_mm=sheet.stage.reference_mm))
        return ("Integral images from elsewhere: nothing is rendered.",)
    notes: dict[str, str] = {}
    for frame in sheet.spec.checked_frames():
        there = sheet.at(frame)
        try:
            found = check_rig(there.spec, there.stage)
        except SpecError as error:
            raise add_frame(error, frame) if sheet.spec.animation else error from error
        for note in found:
            said = f"From frame {frame}: {note}" if sheet.spec.animation else note
            # The numbers of a note change from frame to frame; its text does not.
            notes.setdefault(note.partition(_MEASURED)[0], said)
    return tuple(notes.values())


def check_rig(spec: JobSpec, stage: Stage) -> tuple[str, ...]:
    """Return notes on the optics of a job without keyframes: settings that are allowed but unusual.

    Parameters
    ----------
    spec
        The job without keyframes.
    stage
        The stage of the scene.

    Raises
    ------
    OpticsError
        If the rig cannot be built: a lens is wider than its sphere, the array is inside the imaging lens, or there is
        no real image.
    """
    optical_bench = bench(spec.rig, reference_mm=stage.reference_mm)
    _check_window(optical_bench)
    capture_method(spec, stage)
    if optical_bench.imaging_lens is None:
        _check_direct_pickup(optical_bench)
    else:
        _check_real_image(optical_bench, stage)
        _check_behind_lens(optical_bench)
        _check_stop(optical_bench, stage)
    return (*_image_space_notes(optical_bench, stage), *_f_number_notes(optical_bench))


def _check_window(optical_bench: Bench) -> None:
    """Refuse a device's window that is smaller than the array, or a picture that is too large."""
    device, array = optical_bench.rig.device, optical_bench.rig.lens_array
    if device is None:
        return
    # The size is computed in pitches first, with the same rounding as that of the picture.
    width_mm, height_mm = extent_mm(array)
    px_per_lens = array.pitch_mm / device.pixel_mm
    needed = [max(1, math.floor(side / array.pitch_mm * px_per_lens + 0.5)) for side in (height_mm, width_mm)]
    if max(needed) + 2 * device.margin_px > MAX_FRAME_PX:
        got = f"{needed[0]} x {needed[1]} px and a margin of {device.margin_px} px"
        raise _refused("rig.device", f"a picture of at most {MAX_FRAME_PX} px a side", got)
    window = device.window_px
    if window is not None and (window[0] < needed[0] or window[1] < needed[1]):
        expected = f"at least {needed[0]} x {needed[1]} px, the array's size on the device"
        raise _refused("rig.device.window_px", expected, f"{window[0]} x {window[1]} px")


def _check_direct_pickup(optical_bench: Bench) -> None:
    offset_mm = optical_bench.rig.lens_array.offset_mm
    if offset_mm >= 0:
        expected = "a negative one without imaging lens: the array sees only what lies before it"
        raise _refused("rig.lens_array.offset_mm", expected, f"{offset_mm:g} mm")


def _check_real_image(optical_bench: Bench, stage: Stage) -> None:
    image_mm = optical_bench.image_z_mm(stage.reference_mm) - optical_bench.lens_end_mm
    if not (math.isfinite(image_mm) and image_mm > 0):
        expected = "a reference plane that the imaging lens images behind itself"
        raise _refused("stage.reference_mm", expected, f"{stage.reference_mm:g} mm, imaged at {image_mm:.4g} mm")


def _check_behind_lens(optical_bench: Bench) -> None:
    """Refuse an array inside the imaging lens, whose last surface may reach beyond its vertex."""
    assert optical_bench.imaging_lens is not None  # noqa: S101 - guaranteed by the caller
    last = optical_bench.imaging_lens.surfaces[-1]
    reach_mm = max(
        0.0, last.sag_mm(min(last.semi_aperture_mm, math.hypot(optical_bench.width_mm, optical_bench.height_mm) / 2))
    )
    if optical_bench.mla_behind_lens_mm <= reach_mm:
        offset_mm = optical_bench.rig.lens_array.offset_mm
        most_mm = optical_bench.mla_behind_lens_mm - reach_mm + offset_mm
        expected = f"below {most_mm:.4g} mm, so that the array stands behind the imaging lens"
        raise _refused("rig.lens_array.offset_mm", expected, f"{offset_mm:g} mm")


def _check_stop(optical_bench: Bench, stage: Stage) -> None:
    stop = optical_bench.imaging_lens.stop if optical_bench.imaging_lens else None
    if stop is not None and not -stage.near_mm < stop.z_mm < optical_bench.mla_z_mm:
        expected = f"a stop between the scene and the array, from {-stage.near_mm:g} to {optical_bench.mla_z_mm:.4g} mm"
        raise _refused("rig.imaging_lens.stop_z_mm", expected, f"{stop.z_mm:g} mm")


def _refused(field: str, expected: str, got: str) -> OpticsError:
    return OpticsError.of([FieldProblem(field=field, expected=expected, got=got)])


def place_in_image_space(near_s_mm: float, far_s_mm: float) -> str:
    """Return in one word how a scene is shown: real, mixed or virtual.

    Parameters
    ----------
    near_s_mm
        The depth at which the near end of the scene is shown, s, mm.
    far_s_mm
        The depth at which the far end of the scene is shown, s, mm.
    """
    if far_s_mm >= 0:
        return "real"
    return "virtual" if near_s_mm <= 0 else "mixed"


_PLACES = {
    "real": "The array stands outside the image space, on the lens's side: all is shown real",
    "mixed": "The array stands in the image space: near parts are shown real, far ones virtual",
    "virtual": "The array stands outside the image space, on the camera's side: all is shown virtual",
}


def _image_space_notes(optical_bench: Bench, stage: Stage) -> tuple[str, ...]:
    near_mm, far_mm = optical_bench.s_mm(stage.near_mm), optical_bench.s_mm(stage.far_mm)
    depth = f"{_MEASURED}{far_mm:+.1f} mm (far) to {near_mm:+.1f} mm (near)"
    if optical_bench.imaging_lens is None and near_mm > 0:
        return (f"The array stands among the things it should show: what is nearer than it is not seen{depth}.",)
    if optical_bench.imaging_lens is None:
        return (f"Direct pickup: all is shown virtual{depth}.",)
    return (f"{_PLACES[place_in_image_space(near_mm, far_mm)]}{depth}.",)


def _f_number_notes(optical_bench: Bench) -> tuple[str, ...]:
    lens, array = optical_bench.imaging_lens, optical_bench.rig.lens_array
    if lens is None:
        return ()
    lens_f_number = f_number(lens)
    mla_f_number = array.focal_length_mm / array.pitch_mm
    if lens_f_number <= mla_f_number:
        return ()
    return (
        f"The imaging lens (f/{lens_f_number:.2g}) is slower than the array (f/{mla_f_number:.2g}): "
        "pixels at the edge of every cell stay dark.",
    )
