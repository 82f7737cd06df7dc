"""A preview of a job: the same optics with fewer lenses and pixels, for pictures that follow a slider.

The smaller rig covers the area of the whole one. Its lenses are larger by one factor, and so is their focal length: the
angle of view of a lens, its f-number and the depths of the image stay, and only the resolution falls.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.optics.rig import LensArray, Rig
from lippmann.job.rendering.render_settings import Capture
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec
from lippmann.lattice.cell import Lattice

LENSES = 45
"""The number of lenses across a preview that nobody has chosen."""
PX_PER_LENS = 8
"""The number of pixels across a lens of a preview that nobody has chosen."""
MOST_LENSES = 90
MOST_PX_PER_LENS = 16
"""The largest size of a preview; it has 2 million pixels."""
BANDS = 3
"""The largest number of wavelength bands of a preview; each is traced as a picture of its own."""
PREVIEW_ID = "preview"
"""The id of the job of all previews, which is no job of the farm."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False)


class PreviewPicture(_Part):
    """A picture of a preview."""

    rows: int
    """The height in pixels."""
    cols: int
    """The width in pixels."""
    png: str
    """The PNG of 8 bits a channel, as base64."""


class PreviewRig(_Part):
    """The numbers of the rig that a preview is rendered with."""

    lens_rows: int
    lens_cols: int
    px_per_lens: int
    lattice: Lattice
    pitch_mm: float
    focal_length_mm: float
    rows_px: int
    """The height of the integral image."""
    cols_px: int
    """The width of the integral image."""


class PreviewTimes(_Part):
    """The times of a preview at the worker, in seconds."""

    start_s: float
    """The time in which engine and scene were started and loaded; almost 0 if they were there."""
    render_s: float
    """The time of the engine, from the request to the pixels, with its start."""
    pictures_s: float
    """The time in which the pictures were made of the pixels."""
    cpu_s: float
    """The CPU time of all of it, the engine's processes included."""


class PreviewSize(NamedTuple):
    """The largest size of a preview."""

    lenses: int = LENSES
    """The largest number of lenses across and down."""
    px_per_lens: int = PX_PER_LENS
    """The largest number of pixels across a lens."""


class PreviewJob(NamedTuple):
    """The job of a preview."""

    job: ResolvedJob
    """The job at its frame, with the smaller rig."""
    notes: tuple[str, ...]
    """The differences from the job that was asked for."""


def preview_job(sheet: ResolvedJob, *, frame: int, size: PreviewSize, owner: str = "") -> PreviewJob:
    """Return the job that is rendered for a preview of a job.

    Parameters
    ----------
    sheet
        The job.
    frame
        The number of the frame.
    size
        The largest size of the preview.
    owner
        The owner of the preview; what is kept for the next preview is kept for the same owner only.

    Raises
    ------
    SpecError
        If nothing is rendered for the job, a number is out of bounds at the frame, or a lens would be too large.
    """
    if sheet.sheets is not None:
        problem = FieldProblem(field="scene", expected="a scene that is rendered", got="imported integral images")
        raise SpecError.of([problem])
    there = sheet.at(frame)
    rig, of_rig = _smaller_rig(there.spec.rig, size)
    spec, of_spec = _quicker_spec(there.spec)
    spec = spec.model_copy(update={"rig": rig, "outputs": ()})
    job = there.model_copy(update={"spec": spec, "job_id": PREVIEW_ID, "cache_scope": owner})
    return PreviewJob(job, (*of_rig, *of_spec))


def rig_numbers(rig: Rig) -> PreviewRig:
    """Return the numbers of a rig that a preview names."""
    array, layout = rig.lens_array, rig.layout
    return PreviewRig(
        lens_rows=array.count[0],
        lens_cols=array.count[1],
        px_per_lens=rig.px_per_lens,
        lattice=array.lattice,
        pitch_mm=array.pitch_mm,
        focal_length_mm=array.focal_length_mm,
        rows_px=layout.rows,
        cols_px=layout.cols,
    )


def _smaller_rig(rig: Rig, size: PreviewSize) -> tuple[Rig, list[str]]:
    """Return a rig of at most this size that covers the same area, and notes on it."""
    notes = []
    array = rig.lens_array
    fewer = _larger_lenses(array, size.lenses)
    if fewer.count != array.count:
        notes.append(
            f"{_times(fewer.count)} lenses of {fewer.pitch_mm:.4g} mm stand for {_times(array.count)} of "
            f"{array.pitch_mm:.4g} mm, over the same area and with the same angles."
        )
    step = array.lenses_mm.cell.row_period
    px_per_lens = min(rig.px_per_lens, max(step, size.px_per_lens // step * step))
    if px_per_lens != rig.px_per_lens:
        notes.append(f"A lens has {px_per_lens} px in place of {rig.px_per_lens}.")
    if rig.device is not None:
        notes.append("The picture is not resampled for the device.")
    update = {"lens_array": fewer, "px_per_lens": px_per_lens, "device": None}
    return rig.model_copy(update=update), notes


def _larger_lenses(array: LensArray, most: int) -> LensArray:
    longest = max(array.count)
    if longest <= most:
        return array
    factor = longest / most
    larger: dict[str, Any] = {
        "preset": None,
        "count": tuple(max(1, round(count / factor)) for count in array.count),
        "pitch_mm": array.pitch_mm * factor,
        "focal_length_mm": array.focal_length_mm * factor,
    }
    for name, most_mm in (("pitch_mm", 1000.0), ("focal_length_mm", 10_000.0)):
        if larger[name] > most_mm:
            expected = f"at most {most_mm / factor:.6g} for a preview of {most} lenses"
            problem = FieldProblem(f"rig.lens_array.{name}", expected, f"{getattr(array, name):g}")
            raise SpecError.of([problem])
    return array.model_copy(update=larger)


def _quicker_spec(spec: JobSpec) -> tuple[JobSpec, list[str]]:
    """Return a job with one ray a pixel and without channels, and notes on it."""
    capture, render = spec.capture, spec.render
    notes = []
    if capture.supersample > 1:
        notes.append(f"capture.supersample is 1 in place of {capture.supersample}.")
    if render.samples > 1:
        notes.append(f"render.samples is 1 in place of {render.samples}: mirrors and refraction, and no diffuse paths.")
    if render.antialias != "off":
        notes.append("render.antialias is off.")
    bands = min(capture.bands, BANDS)
    if spec.rig.dispersion and bands < capture.bands and spec.capture.method != "glass":
        notes.append(f"capture.bands is {bands} in place of {capture.bands}.")
    quicker = Capture(method=capture.method, bands=bands)
    one_ray = render.model_copy(update={"samples": 1, "antialias": "off", "tiles": "auto"})
    return spec.model_copy(update={"capture": quicker, "render": one_ray}), notes


def _times(count: tuple[int, int]) -> str:
    """Return a number of lenses as users write it, columns first."""
    rows, cols = count
    return f"{cols} x {rows}"
