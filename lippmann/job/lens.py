"""The imaging lens as a job asks for it: a table of surfaces, or a published lens made to another focal length."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from lippmann.job.glasses import GLASSES, glass

MIN_SURFACES = 2
MAX_SURFACES = 60
MAX_MM = 1e6
"""A kilometre: more is a slip of units."""
MIN_MM = 1e-6
"""A nanometre, of radii and focal lengths: less is one too."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class _UnknownMaterial(str):
    """The name of a material that is not known, of a surface that has no index either."""

    __slots__ = ()


class LensSurface(_Part):
    """A surface and the medium behind it."""

    radius_mm: float | None = Field(ge=-MAX_MM, le=MAX_MM)
    """Positive when the centre lies behind (toward the camera); null is a plane."""
    thickness_mm: float = Field(default=0.0, ge=0, le=MAX_MM)
    """To the vertex of the next surface."""
    material: str | None = Field(default=None, min_length=1, max_length=40)
    """Of the medium behind; stands in place of `index` and `abbe` when they are not given."""
    index: float = Field(default=None, ge=1, le=4, validate_default=True)
    """Of refraction, of the medium behind; 1 is air."""
    abbe: float | None = Field(default=None, ge=1, le=1000, validate_default=True)
    """Vd of the medium behind; without it the medium has no dispersion."""
    semi_aperture_mm: float = Field(gt=0, le=MAX_MM)
    """Half the clear diameter."""
    conic: float = Field(default=0.0, ge=-1000, le=1000)
    """0 sphere, -1 paraboloid, below -1 hyperboloid, between ellipsoid."""
    aspheric: tuple[float, ...] = Field(default=(), max_length=8)
    """Terms of r^4, r^6, ... of the sag, in mm^-3, mm^-5, ..."""

    @model_validator(mode="before")
    @classmethod
    def _mark_unknown_material(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or not isinstance(data.get("material"), str) or data.get("index") is not None:
            return data
        return data if glass(data["material"]) else {**data, "material": _UnknownMaterial(data["material"])}

    @field_validator("radius_mm")
    @classmethod
    def _is_no_point(cls, radius_mm: float | None) -> float | None:
        if radius_mm == 0:
            raise ValueError("a radius other than 0, or null for a plane")
        if radius_mm is not None and abs(radius_mm) < MIN_MM:
            raise ValueError(f"a radius of at least {MIN_MM:g} mm, or null for a plane")
        return radius_mm

    @field_validator("material", mode="before")
    @classmethod
    def _is_known(cls, name: object) -> object:
        if isinstance(name, _UnknownMaterial):
            raise ValueError(f"one of {', '.join(GLASSES)}, or an index of refraction beside it")
        return name

    @field_validator("index", mode="before")
    @classmethod
    def _index_of_material(cls, index: object, info: ValidationInfo) -> object:
        if index is not None:
            return index
        if "material" not in info.data:
            return 1.0  # what is wrong is the material, and only that is said
        known = glass(info.data["material"] or "")
        if known is None:
            raise ValueError("an index of refraction, or a material")
        return known.index

    @field_validator("abbe", mode="before")
    @classmethod
    def _abbe_of_material(cls, abbe: object, info: ValidationInfo) -> object:
        name = info.data.get("material")
        known = glass(name) if name is not None and abbe is None else None
        # A material beside an index of its own: its dispersion counts only if it is that glass.
        if known is None or info.data.get("index") != known.index:
            return abbe
        return known.abbe


class Prescription(_Part):
    """An imaging lens surface by surface, object side first."""

    title: str = Field(default="", max_length=200)
    source: str = Field(default="", max_length=500)
    """Where the numbers come from."""
    surfaces: tuple[LensSurface, ...] = Field(max_length=MAX_SURFACES, json_schema_extra={"minItems": MIN_SURFACES})
    stop_z_mm: float | None = Field(default=None, ge=-MAX_MM, le=MAX_MM)
    """Where a variable stop stands, from the vertex of surface 1."""

    @field_validator("surfaces")
    @classmethod
    def _are_enough(cls, surfaces: tuple[LensSurface, ...]) -> tuple[LensSurface, ...]:
        # Not by min_length, which would count only those that are right, and say so beside what is wrong.
        if len(surfaces) < MIN_SURFACES:
            raise ValueError(f"at least {MIN_SURFACES} surfaces, got {len(surfaces)}")
        return surfaces

    @model_validator(mode="after")
    def _ends_in_air(self) -> Self:
        last = self.surfaces[-1]
        if last.index != 1:
            raise ValueError(f"air (index 1) behind the last surface, got index {last.index:g}")
        if all(surface.index == 1 for surface in self.surfaces):
            raise ValueError("glass between some of the surfaces, got air behind all of them")
        return self


class NamedLens(_Part):
    """A published lens made to a focal length: all its lengths scaled alike."""

    name: str = Field(min_length=1, max_length=100)
    focal_length_mm: float = Field(ge=MIN_MM, le=100_000)
