"""Bundles of imported integral images: their lens geometry, and jobs that process them without rendering."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from lippmann.errors import BundleError, FieldProblem, SpecError
from lippmann.job.problems import Misfit, problems_of
from lippmann.job.rig import MAX_FRAME_PX, MIN_PX_PER_LENS, Rig, check_px_per_lens
from lippmann.job.spec import JobSpec
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.layout import CellLayout

FOCAL_IN_PITCHES = 3.3
"""Of an array that nothing is said of: the paper's."""

Px = Annotated[float, Field(ge=-MAX_FRAME_PX, le=MAX_FRAME_PX)]
Count = Annotated[int, Field(ge=1, le=4096)]
PitchPx = Annotated[float, Field(ge=MIN_PX_PER_LENS, le=MAX_FRAME_PX)]


class SheetGeometry(BaseModel):
    """The lenses over an integral image from elsewhere, and what must be turned to show it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    pitch_px: PitchPx
    """Across a lens, any number."""
    lattice: Lattice = "square"
    row_pitch_px: PitchPx | None = None
    """From one lens row to the next; what square pixels make of the pitch when not given."""
    first_row_shifted: bool = False
    """Hexagonal: the first lens row is one of those half a lens further right."""
    rotation_deg: float = Field(default=0.0, ge=-45, le=45)
    """Of the lens rows, clockwise as one looks at the picture."""
    offset_px: tuple[Px, Px] | None = None
    """Centre of the first lens, (down, right) from the picture's top left corner; when not given, the lenses stand in
    the middle of the picture."""
    count: tuple[Count, Count] | None = None
    """(lens_rows, lens_cols); as many whole ones as there are when not given."""
    px_per_lens: int | None = Field(default=None, ge=MIN_PX_PER_LENS, le=4096)
    """Of the cells that are made of it; the whole number nearest the pitch, even for hexagons, when not given."""
    pseudoscopic: bool = False
    """Depth is inside out, as an array records it: every elemental image must be turned by half a turn."""
    inverted: bool = False
    """The picture is upside down, as a lens before the array leaves it."""
    pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """Of the lenses; 1 mm when not given, and then depths are only relative."""
    focal_length_mm: float | None = Field(default=None, gt=0, le=10_000)
    """Of the lenses, the display's gap; 3.3 pitches when not given."""

    @property
    def lens_pitch_mm(self) -> float:
        """Of the lenses, said or not."""
        return self.pitch_mm or 1.0

    def lens_focal_mm(self, pitch_mm: float) -> float:
        """Return the lenses' focal length, said or not, at a pitch."""
        return self.focal_length_mm or FOCAL_IN_PITCHES * pitch_mm

    @model_validator(mode="after")
    def _shifted_among_hexagons(self) -> Self:
        if self.first_row_shifted and not CELLS[self.lattice].row_shift:
            raise Misfit("first_row_shifted", expected="false on a square lattice", got="true")
        if self.px_per_lens is not None:
            check_px_per_lens(self.px_per_lens, self.lattice)
        return self


SUFFIXES = (".png", ".tif", ".tiff", ".exr")

ONLY_RENDERED = ("capture", "render", "stage", "animation", "clock")
"""Fields of a job, and below of its rig, that say how a scene is rendered."""

ONLY_CAPTURED = ("imaging_lens", "f_number", "stop_mm", "dispersion", "camera")


class ForeignSheets(SheetGeometry):
    """What `[sheets]` in a bundle's `scene.toml` says."""

    files: Annotated[str, Field(min_length=1, max_length=200)] | tuple[str, ...]
    """The pictures, by name frames 1, 2, ..: a pattern as `frames/*.png`; once looked through, their names."""
    linear: bool = False
    """The codes of the pictures are linear light, whatever their files say."""

    @model_validator(mode="after")
    def _says_its_size(self) -> Self:
        """Refuse what leaves open how large the sheets will be: a job is planned before a picture is read."""
        for field in ("count", "px_per_lens"):
            if getattr(self, field) is None:
                raise Misfit(field, expected="a value, as lippmann import --bundle writes it", got="nothing")
        rows, cols = self.count or (1, 1)
        n = self.px_per_lens or MIN_PX_PER_LENS
        captured = CellLayout(rows, cols, n, self.lattice, first_row_shifted=self.first_row_shifted and rows > 1)
        shown = captured.turned() if self.inverted else captured
        if shown.first_row_shifted:
            got = "a lens row that comes out on top and shifted"
            raise Misfit("count", expected="lenses without the outermost row, which would be shifted", got=got)
        return self

    def among(self, names: Sequence[str]) -> ForeignSheets:
        """Return the same with the names of its pictures.

        Raises
        ------
        BundleError
            If there are none, or one that is listed is not in the bundle.
        """
        pattern = self.files
        if not isinstance(pattern, str):
            strange = [name for name in pattern if name not in names or not name.lower().endswith(SUFFIXES)]
            if strange or not pattern:
                got = repr(strange[0]) if strange else "none"
                raise BundleError(
                    f"scene.toml: sheets.files: expected pictures ({', '.join(SUFFIXES)}) of the bundle, got {got}"
                )
            return self
        found = tuple(sorted(n for n in names if fnmatchcase(n, pattern) and n.lower().endswith(SUFFIXES)))
        if not found:
            raise BundleError(f"scene.toml: sheets.files: expected pictures ({', '.join(SUFFIXES)}) as {pattern!r}")
        return self.model_copy(update={"files": found})

    def job_of(self, spec: JobSpec) -> JobSpec:
        """Return a job with the rig that these sheets are of: what the job says of mm and the device holds.

        Raises
        ------
        SpecError
            If it asks for other lenses, for a frame that is not there, or for something to be rendered.
        """
        problems = [*self._asked_to_render(spec), *self._otherwise(spec)]
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
        said, array = rig.lens_array.model_fields_set, data["lens_array"]
        array |= {"count": self.count, "lattice": self.lattice, "offset_mm": 0.0}
        if "pitch_mm" not in said:
            array["pitch_mm"] = self.lens_pitch_mm
        if "focal_length_mm" not in said:
            array["focal_length_mm"] = self.lens_focal_mm(array["pitch_mm"])
        return data | {"lens_array": array, "px_per_lens": self.px_per_lens, "imaging_lens": None}

    def _asked_to_render(self, spec: JobSpec) -> Iterator[FieldProblem]:
        plain, expected = JobSpec(scene=spec.scene), "nothing: these sheets are there already, nothing is rendered"
        for name in ONLY_RENDERED:
            if getattr(spec, name) != getattr(plain, name):
                yield FieldProblem(field=name, expected=expected, got="something else than the default")
        for name in ONLY_CAPTURED:
            value = getattr(spec.rig, name)
            if name in spec.rig.model_fields_set and value not in (None, getattr(plain.rig, name)):
                yield FieldProblem(field=f"rig.{name}", expected=expected, got=repr(value)[:100])

    def _otherwise(self, spec: JobSpec) -> Iterator[FieldProblem]:
        array = spec.rig.lens_array
        for name in ("count", "lattice"):
            if name in array.model_fields_set and getattr(array, name) != getattr(self, name):
                got = repr(getattr(array, name))
                yield FieldProblem(
                    f"rig.lens_array.{name}", expected=f"{getattr(self, name)!r}, as the sheets", got=got
                )
        said = "px_per_lens" in spec.rig.model_fields_set and spec.rig.device is None
        if said and spec.rig.px_per_lens != self.px_per_lens:
            expected = f"{self.px_per_lens}, as the sheets"
            yield FieldProblem(field="rig.px_per_lens", expected=expected, got=str(spec.rig.px_per_lens))
