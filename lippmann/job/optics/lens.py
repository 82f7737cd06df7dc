"""The imaging lens of a job: a table of surfaces, or a published lens scaled to a focal length."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from lippmann.job.fields.model import JobModel, at_most
from lippmann.job.optics.glasses import expected_glass, glass

MIN_SURFACES = 2
MAX_SURFACES = 60
MAX_MM = 1e6
"""The greatest length, one kilometre; a greater one is an error of units."""
MIN_MM = 1e-6
"""The least radius and focal length, one nanometre; a smaller one is an error of units."""


class _UnknownMaterial(str):
    """The name of an unknown material, on a surface without an index."""

    __slots__ = ()


class LensSurface(JobModel):
    """A lens surface and the medium behind it."""

    radius_mm: float | None = Field(ge=-MAX_MM, le=MAX_MM)
    """The radius of curvature, positive if the centre lies behind the surface (toward the camera); null for a plane."""
    thickness_mm: float = Field(default=0.0, ge=0, le=MAX_MM)
    """The distance to the vertex of the next surface."""
    material: str | None = Field(default=None, min_length=1, max_length=40)
    """The name of the medium behind the surface; it supplies `index` and `abbe` if they are absent."""
    index: float = Field(default=None, ge=1, le=4, validate_default=True)
    """The refractive index of the medium behind the surface; 1 is air."""
    abbe: float | None = Field(default=None, ge=1, le=1000, validate_default=True)
    """The Abbe number Vd of the medium behind the surface; null for a medium without dispersion."""
    semi_aperture_mm: float = Field(gt=0, le=MAX_MM)
    """Half the clear diameter of the surface."""
    conic: float = Field(default=0.0, ge=-1000, le=1000)
    """The conic constant: 0 for a sphere, -1 for a paraboloid, less for a hyperboloid, between 0 and -1 for an
    ellipsoid."""
    aspheric: Annotated[tuple[float, ...], Field(max_length=8), at_most(8)] = ()
    """The coefficients of r^4, r^6, ... in the sag, in mm^-3, mm^-5, ..."""

    @model_validator(mode="before")
    @classmethod
    def _mark_unknown_material(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or not isinstance(data.get("material"), str) or data.get("index") is not None:
            return data
        return data if glass(data["material"]) else {**data, "material": _UnknownMaterial(data["material"])}

    @field_validator("radius_mm")
    @classmethod
    def _check_radius(cls, radius_mm: float | None) -> float | None:
        if radius_mm == 0:
            raise ValueError("a radius other than 0, or null for a plane")
        if radius_mm is not None and abs(radius_mm) < MIN_MM:
            raise ValueError(f"a radius of at least {MIN_MM:g} mm, or null for a plane")
        return radius_mm

    @field_validator("material", mode="before")
    @classmethod
    def _check_material(cls, name: object) -> object:
        if isinstance(name, _UnknownMaterial):
            raise ValueError(f"{expected_glass(name)}, or an index of refraction beside it")
        return name

    @field_validator("index", mode="before")
    @classmethod
    def _index_of_material(cls, index: object, info: ValidationInfo) -> object:
        if index is not None:
            return index
        if "material" not in info.data:
            return 1.0  # The material is invalid, and only that is reported.
        known = glass(info.data["material"] or "")
        if known is None:
            raise ValueError("an index of refraction, or a material")
        return known.index

    @field_validator("abbe", mode="before")
    @classmethod
    def _abbe_of_material(cls, abbe: object, info: ValidationInfo) -> object:
        name = info.data.get("material")
        known = glass(name) if name is not None and abbe is None else None
        # If both a material and an index are given, the Abbe number of the material counts only if the index is its
        # own.
        if known is None or info.data.get("index") != known.index:
            return abbe
        return known.abbe


class Prescription(JobModel):
    """The prescription of an imaging lens, surface by surface, object side first."""

    title: str = Field(default="", max_length=200)
    """The title of the lens."""
    source: str = Field(default="", max_length=500)
    """The publication that the prescription is from."""
    surfaces: Annotated[
        tuple[LensSurface, ...],
        Field(max_length=MAX_SURFACES, json_schema_extra={"minItems": MIN_SURFACES}),
        at_most(MAX_SURFACES),
    ]
    """The surfaces, from the object to the image."""
    stop_z_mm: float | None = Field(default=None, ge=-MAX_MM, le=MAX_MM)
    """The position of a variable stop behind the vertex of surface 1."""

    @field_validator("surfaces")
    @classmethod
    def _check_count(cls, surfaces: tuple[LensSurface, ...]) -> tuple[LensSurface, ...]:
        # `min_length` would count only the valid surfaces, and report a second error beside that of an invalid one.
        if len(surfaces) < MIN_SURFACES:
            raise ValueError(f"at least {MIN_SURFACES} surfaces, got {len(surfaces)}")
        return surfaces

    @model_validator(mode="after")
    def _check_media(self) -> Self:
        last = self.surfaces[-1]
        if last.index != 1:
            raise ValueError(f"air (index 1) behind the last surface, got index {last.index:g}")
        if all(surface.index == 1 for surface in self.surfaces):
            raise ValueError("glass between some of the surfaces, got air behind all of them")
        return self


class NamedLens(JobModel):
    """A published lens that is scaled to a focal length."""

    name: str = Field(min_length=1, max_length=100)
    """The name of the lens."""
    focal_length_mm: float = Field(ge=MIN_MM, le=100_000)
    """The focal length to which all lengths of the lens are scaled."""
