"""Bundles of imported integral images: their lens geometry, and jobs that process them without rendering."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from lippmann.errors import BundleError, FieldProblem, SpecError
from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.optics.rig import MAX_FRAME_PX, MIN_PX_PER_LENS, Rig, check_px_per_lens
from lippmann.job.spec import JobSpec
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.layout import CellLayout
from lippmann.untrusted.shown import shown

DEFAULT_FOCAL_LENGTH_PITCHES = 3.3
"""The default focal length in lens pitches, that of the paper's array."""

Px = Annotated[float, Field(ge=-MAX_FRAME_PX, le=MAX_FRAME_PX)]
Count = Annotated[int, Field(ge=1, le=4096)]
PitchPx = Annotated[float, Field(ge=MIN_PX_PER_LENS, le=MAX_FRAME_PX)]


class SheetGeometry(JobModel):
    """The lens geometry of an imported integral image, and the corrections that it needs."""

    pitch_px: PitchPx
    """The lens pitch in pixels, which may be fractional."""
    lattice: Lattice = "square"
    """The lattice of the lenses."""
    row_pitch_px: PitchPx | None = None
    """The distance from one lens row to the next; by default that of square pixels."""
    first_row_shifted: bool = False
    """True if the first lens row of a hexagonal lattice is one that is shifted to the right by half a lens."""
    rotation_deg: float = Field(default=0.0, ge=-45, le=45)
    """The rotation of the lens rows, clockwise in the picture."""
    offset_px: tuple[Px, Px] | None = None
    """The centre of the first lens as (down, right) from the top left corner of the picture; by default the lattice is
    in the middle of the picture."""
    count: tuple[Count, Count] | None = None
    """The number of lenses as (lens_rows, lens_cols); by default all complete lenses."""
    px_per_lens: int | None = Field(default=None, ge=MIN_PX_PER_LENS, le=4096)
    """The pixels of the resampled cells; by default the integer nearest to the pitch, or the even integer on a
    hexagonal lattice."""
    pseudoscopic: bool = False
    """True if the image is pseudoscopic, as an array records it: every elemental image is rotated by 180 degrees."""
    inverted: bool = False
    """True if the picture is upside down, as an imaging lens in front of the array leaves it."""
    pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """The lens pitch in mm; by default 1 mm, and then depths are only relative."""
    focal_length_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The focal length of the lenses, which is the gap of the display; by default 3.3 pitches."""

    @property
    def lens_pitch_mm(self) -> float:
        """The lens pitch, or its default, mm."""
        return self.pitch_mm or 1.0

    def lens_focal_length_mm(self, pitch_mm: float) -> float:
        """Return the focal length of the lenses, or its default at a pitch, mm."""
        return self.focal_length_mm or DEFAULT_FOCAL_LENGTH_PITCHES * pitch_mm

    @model_validator(mode="after")
    def _check_lattice(self) -> Self:
        if self.first_row_shifted and not CELLS[self.lattice].row_shift:
            raise FieldError("first_row_shifted", expected="false on a square lattice", got="true")
        if self.px_per_lens is not None:
            check_px_per_lens(self.px_per_lens, self.lattice)
        return self


SUFFIXES = (".png", ".tif", ".tiff", ".exr", ".jpg", ".jpeg", ".pfm", ".ppm", ".pgm")
"""The suffixes of pictures that can be imported."""

_PAGE = re.compile(r"(.+)#([1-9][0-9]{0,4})")


def file_and_page(name: str) -> tuple[str, int | None]:
    """Return the file of a picture that a bundle lists, and the number of its page, from 0; None if no page is named.

    >>> file_and_page("frames/0001.tif#2"), file_and_page("frames/0002.png")
    (('frames/0001.tif', 1), ('frames/0002.png', None))
    """
    found = _PAGE.fullmatch(name)
    return (found[1], int(found[2]) - 1) if found else (name, None)


def _is_picture(name: str, names: frozenset[str]) -> bool:
    """Return whether a name, which may name a page, is that of a picture of the bundle."""
    file, _ = file_and_page(name)
    return file in names and file.lower().endswith(SUFFIXES)


RENDER_FIELDS = ("capture", "render", "stage", "animation", "clock")
"""The fields of a job that apply only if a scene is rendered."""

CAPTURE_FIELDS = ("imaging_lens", "f_number", "stop_mm", "dispersion", "camera")
"""The fields of a rig that apply only if a scene is rendered."""


class ImportedSheets(SheetGeometry):
    """The imported integral images of a bundle: `[sheets]` in its `scene.toml`."""

    files: Annotated[str, Field(min_length=1, max_length=200)] | tuple[str, ...]
    """The pictures of frames 1, 2, ..., in the order of their names: a pattern as `frames/*.png`, or their names, which
    replace the pattern when the bundle is checked. `frames/0001.tif#2` is the second page of a file."""
    linear: bool = False
    """True if the codes of the pictures are linear light, whatever their files declare."""
    white_level: int | None = Field(default=None, ge=1, le=65_535)
    """The code of white, as 4095 of a camera with 12 bits; by default the highest code of the file."""
    white: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """The picture of an evenly lit white surface by which the pictures are divided."""

    @model_validator(mode="after")
    def _check_size_is_given(self) -> Self:
        """Refuse sheets without `count` or `px_per_lens`: a job is planned before a picture is read."""
        for field in ("count", "px_per_lens"):
            if getattr(self, field) is None:
                raise FieldError(field, expected="a value, as lippmann import --bundle writes it", got="nothing")
        rows, cols = self.count or (1, 1)
        n = self.px_per_lens or MIN_PX_PER_LENS
        captured = CellLayout(rows, cols, n, self.lattice, first_row_shifted=self.first_row_shifted and rows > 1)
        shown = captured.turned() if self.inverted else captured
        if shown.first_row_shifted:
            got = "a lens row that comes out on top and shifted"
            raise FieldError("count", expected="lenses without the outermost row, which would be shifted", got=got)
        return self

    def with_files(self, names: Sequence[str]) -> ImportedSheets:
        """Return the sheets with the names of their pictures in place of a pattern.

        Raises
        ------
        BundleError
            If the bundle has no such pictures, or not all that are listed.
        """
        known = frozenset(names)
        if self.white is not None and not _is_picture(self.white, known):
            raise BundleError(f"scene.toml: sheets.white: expected a picture of the bundle, got {shown(self.white)}")
        pattern = self.files
        if not isinstance(pattern, str):
            invalid = [name for name in pattern if not _is_picture(name, known)]
            if invalid or not pattern:
                got = shown(invalid[0]) if invalid else "none"
                raise BundleError(
                    f"scene.toml: sheets.files: expected pictures ({', '.join(SUFFIXES)}) of the bundle, got {got}"
                )
            return self
        found = tuple(
            sorted(n for n in names if fnmatchcase(n, pattern) and n.lower().endswith(SUFFIXES) and n != self.white)
        )
        if not found:
            raise BundleError(f"scene.toml: sheets.files: expected pictures ({', '.join(SUFFIXES)}) as {pattern!r}")
        return self.model_copy(update={"files": found})

    def job_on_sheets(self, spec: JobSpec) -> JobSpec:
        """Return a job with the rig of these sheets; the lengths in mm and the device remain those of the job.

        Raises
        ------
        SpecError
            If the job has other lenses, a frame without a picture, or a setting that applies only to rendering.
        """
        problems = [*self._render_settings(spec), *self._different_lenses(spec)]
        if max(spec.frame_numbers) > len(self.files):
            expected = f"frames 1 to {len(self.files)}, one for every picture of the bundle"
            problems.append(FieldProblem(field="frames", expected=expected, got=repr(spec.frames)))
        if problems:
            raise SpecError.of(problems)
        try:
            return spec.model_copy(update={"rig": Rig.model_validate(self._rig(spec.rig))})
        except ValidationError as error:
            raise SpecError.of(problems_of(error)) from error

    def _rig(self, rig: Rig) -> dict[str, Any]:
        data = rig.model_dump(mode="json")
        given, array = rig.lens_array.model_fields_set, data["lens_array"]
        array |= {"count": self.count, "lattice": self.lattice, "offset_mm": 0.0}
        if "pitch_mm" not in given:
            array["pitch_mm"] = self.lens_pitch_mm
        if "focal_length_mm" not in given:
            array["focal_length_mm"] = self.lens_focal_length_mm(array["pitch_mm"])
        return data | {"lens_array": array, "px_per_lens": self.px_per_lens, "imaging_lens": None}

    def _render_settings(self, spec: JobSpec) -> Iterator[FieldProblem]:
        plain, expected = JobSpec(scene=spec.scene), "nothing: these sheets are there already, nothing is rendered"
        for name in RENDER_FIELDS:
            if getattr(spec, name) != getattr(plain, name):
                yield FieldProblem(field=name, expected=expected, got="something else than the default")
        for name in CAPTURE_FIELDS:
            value = getattr(spec.rig, name)
            if name in spec.rig.model_fields_set and value not in (None, getattr(plain.rig, name)):
                yield FieldProblem(field=f"rig.{name}", expected=expected, got=repr(value)[:100])

    def _different_lenses(self, spec: JobSpec) -> Iterator[FieldProblem]:
        array = spec.rig.lens_array
        for name in ("count", "lattice"):
            if name in array.model_fields_set and getattr(array, name) != getattr(self, name):
                got = repr(getattr(array, name))
                yield FieldProblem(
                    f"rig.lens_array.{name}", expected=f"{getattr(self, name)!r}, as the sheets", got=got
                )
        given = "px_per_lens" in spec.rig.model_fields_set and spec.rig.device is None
        if given and spec.rig.px_per_lens != self.px_per_lens:
            expected = f"{self.px_per_lens}, as the sheets"
            yield FieldProblem(field="rig.px_per_lens", expected=expected, got=str(spec.rig.px_per_lens))
