"""Render settings of a job: capture method, channels, engine, samples, antialiasing, tiles and limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, model_validator

from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import FieldError, form_discriminator

Channel = Literal["depth", "normal", "albedo", "object", "motion"]
"""A quantity that is rendered for every pixel besides its colour."""


class Capture(JobModel):
    """The method by which the rays of the camera are traced through the optics, and the samples of a pixel."""

    method: Literal["auto", "glass", "ray_camera"] = "auto"
    """`glass`: POV-Ray refracts the rays in a model of the lenses. `ray_camera`: the rays come from the exact trace.
    `auto` uses the ray camera where it can render the job."""
    supersample: int = Field(default=1, ge=1, le=8)
    """The number of rendered pixels in each direction that are averaged to one pixel, in linear light."""
    bands: int = Field(default=7, ge=2, le=32)
    """The number of wavelength bands into which light is split with `rig.dispersion`."""
    depth: bool = False
    """True if the depth of every pixel is rendered into `depth/0001.exr`; the same as the channel `depth`."""
    channels: Annotated[tuple[Channel, ...], Field(max_length=5)] = ()
    """The channels that are rendered besides the colour; POV-Ray renders the depth alone."""

    @model_validator(mode="before")
    @classmethod
    def _depth_is_a_channel(cls, data: Any) -> Any:
        channels = data.get("channels") if isinstance(data, Mapping) else None
        if not isinstance(channels, list | tuple) or "depth" not in channels:
            return data
        if data.get("depth") is False:
            raise FieldError("depth", expected="true, or no channel depth in channels", got="false")
        return {**data, "depth": True}

    @model_validator(mode="after")
    def _check_channels(self) -> Self:
        if len(set(self.channels)) < len(self.channels):
            raise FieldError("channels", expected="each channel once", got=", ".join(self.channels))
        return self


class Antialias(JobModel):
    """POV-Ray's antialiasing, over the whole image; it blurs the borders of the cells."""

    threshold: float = Field(default=0.3, gt=0, lt=1)
    """The difference between adjacent pixels above which they are sampled again; POV-Ray 3.7 treats 1 as off."""
    method: Literal[1, 2] = 2
    """1: not recursive; such a frame is never tiled. 2: adaptive and recursive."""
    depth: int = Field(default=3, ge=1, le=9)
    """The depth of the subdivision of a pixel."""


AntialiasChoice = Annotated[
    Annotated[Literal["off"], Tag("(off)")] | Annotated[Antialias, Tag("(on)")],
    form_discriminator(lambda value: "on" if isinstance(value, Mapping) else "off"),
]


TileRows = Annotated[int, Field(ge=1, le=64, title="Rows")]
TileCols = Annotated[int, Field(ge=1, le=64, title="Columns")]


class RenderSettings(JobModel):
    """The engine and its settings, and the limits of an attempt."""

    engine: Literal["auto", "povray", "mitsuba"] = "auto"
    """The engine that renders; `auto` is the one that reads the scene file of the bundle."""
    samples: int = Field(default=1, ge=1, le=1024)
    """The number of rays a pixel. Mitsuba traces 1 without noise and more as paths; POV-Ray traces 1."""
    path_depth: int = Field(default=8, ge=1, le=64)
    """The greatest number of surfaces that Mitsuba follows a ray or a path to."""
    clamp: float | None = Field(default=None, gt=0, le=1e6)
    """The greatest radiance of one sample of Mitsuba, in linear light; null for no limit."""
    antialias: AntialiasChoice = "off"
    """The antialiasing, or `off`."""
    tiles: Literal["auto"] | tuple[TileRows, TileCols] = "auto"
    """The tiles of a frame as (tile_rows, tile_cols); `auto` derives them from the measured cost."""
    cache: bool = True
    """True if tiles are taken from the render cache, where a tile of the same definition is, and stored in it."""
    timeout_s: float = Field(default=6 * 3600.0, ge=1, le=7 * 86_400)
    """The time after which an attempt is ended, s."""
    stall_s: float = Field(default=600.0, ge=1, le=86_400)
    """The time without a traced pixel after which an attempt is ended that neither parses nor shoots photons, s."""
    parse_timeout_s: float = Field(default=900.0, ge=1, le=7 * 86_400)
    """The time after which an attempt is ended that still parses its scene, s."""
    photons_timeout_s: float = Field(default=1800.0, ge=1, le=7 * 86_400)
    """The time after which an attempt is ended that still shoots photons, s."""
    probe_timeout_s: float = Field(default=1800.0, ge=1, le=7 * 86_400)
    """The time after which the probe is ended, s."""
    memory_mb: int = Field(default=8192, ge=128, le=1_048_576)
    """The address space that one process of the engine may use, MB."""

    @model_validator(mode="after")
    def _check_tiles(self) -> Self:
        if not self.may_be_tiled and self.tiles not in ("auto", (1, 1)):
            raise FieldError(
                "tiles", expected="auto or [1, 1] with antialias method 1, which leaves seams", got=self.tiles
            )
        return self

    @property
    def may_be_tiled(self) -> bool:
        """True if joined tiles are equal to the whole frame, pixel for pixel; with method 1 they differ (measured)."""
        return self.antialias == "off" or self.antialias.method == 2
