"""A preview of a job: two small pictures of one frame, rendered at once, and the numbers of the smaller rig."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lippmann.plan.preview import (
    LENSES,
    MOST_LENSES,
    MOST_PX_PER_LENS,
    PX_PER_LENS,
    PreviewPicture,
    PreviewRig,
    PreviewTimes,
)
from service.schemas.answer import Answer

STREAM = r"^[A-Za-z0-9_.-]{0,64}$"


class PreviewQuery(BaseModel):
    """The query of a preview."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    frame: Annotated[
        int | None, Field(ge=1, le=999_999, description="The number of the frame, by default the first of the job.")
    ] = None
    lenses: Annotated[int, Field(ge=1, le=MOST_LENSES, description="The largest number of lenses across and down.")] = (
        LENSES
    )
    px_per_lens: Annotated[
        int, Field(ge=2, le=MOST_PX_PER_LENS, description="The largest number of pixels across a lens.")
    ] = PX_PER_LENS
    stream: Annotated[
        str,
        Field(pattern=STREAM, description="A name that the client gives a series of previews, such as those of one "
              "page. A new preview of a series ends the one before it, which is answered with 409. By default a "
              "preview is the only one of its series."),
    ] = ""  # fmt: skip


class Preview(Answer):
    """A preview of a frame, rendered with a smaller rig of the same optics."""

    scene: str
    frame: int
    engine: Literal["povray", "mitsuba"]
    integral: PreviewPicture
    """The orthoscopic integral image, as it is shown."""
    view: PreviewPicture
    """The view in the middle, with square pixels: one pixel a lens on a square lattice."""
    rig: PreviewRig
    """The numbers of the rig that the preview was rendered with."""
    notes: tuple[str, ...]
    """The differences of the preview from the job, and what the engine left out of the scene."""
    times: PreviewTimes
    total_s: float
    """The time from the request to its answer, seconds."""
    worker: str
    """The name of the worker that rendered it."""
