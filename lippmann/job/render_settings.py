"""How a job's rays are found and rendered: the road through the optics, samples, tiles, limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, Tag, model_validator

from lippmann.job.problems import Misfit, told_by


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Capture(_Part):
    """How the rays of the camera find their way through the optics."""

    method: Literal["auto", "glass", "ray_camera"] = "auto"
    """`glass`: POV-Ray refracts them in modelled glass. `ray_camera`: they come from the exact trace."""
    supersample: int = Field(default=1, ge=1, le=8)
    """Rendered pixels in each direction that are averaged to one, inside their cell and in linear light."""
    depth: bool = False
    """Whether a second pass finds how deep what every pixel shows lies: `depth/0001.exr`."""


class Antialias(_Part):
    """POV-Ray's antialiasing over the whole image; it blurs the borders of the cells."""

    threshold: float = Field(default=0.3, gt=0, lt=1)
    """Neighbours that differ by more are sampled again; POV-Ray 3.7 takes 1 for none."""
    method: Literal[1, 2] = 2
    """1: not recursive, never tiled. 2: adaptive and recursive."""
    depth: int = Field(default=3, ge=1, le=9)


AntialiasChoice = Annotated[
    Annotated[Literal["off"], Tag("(off)")] | Annotated[Antialias, Tag("(on)")],
    told_by(lambda value: "on" if isinstance(value, Mapping) else "off"),
]


class RenderSettings(_Part):
    """How POV-Ray renders, and when an attempt is given up."""

    antialias: AntialiasChoice = "off"
    tiles: Literal["auto"] | tuple[Annotated[int, Field(ge=1, le=64)], Annotated[int, Field(ge=1, le=64)]] = "auto"
    """Tiles of a frame as (tile_rows, tile_cols), or cut by the measured cost."""
    timeout_s: float = Field(default=6 * 3600.0, ge=1, le=7 * 86_400)
    """An attempt that runs longer is ended."""
    stall_s: float = Field(default=600.0, ge=1, le=86_400)
    """An attempt without progress for longer is ended."""
    memory_mb: int = Field(default=8192, ge=128, le=1_048_576)
    """Address space that one POV-Ray process may take."""

    @model_validator(mode="after")
    def _method_1_whole(self) -> Self:
        if not self.may_be_tiled and self.tiles not in ("auto", (1, 1)):
            raise Misfit("tiles", expected="auto or [1, 1] with antialias method 1, which leaves seams", got=self.tiles)
        return self

    @property
    def may_be_tiled(self) -> bool:
        """Whether tiles put together are the whole, pixel for pixel: not under method 1 (measured)."""
        return self.antialias == "off" or self.antialias.method == 2
