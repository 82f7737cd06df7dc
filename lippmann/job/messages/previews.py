"""Previews: the order of one, which the service sends to one worker, and the worker's answer.

Nothing of a preview is stored. Its order waits in the list of one worker, and its answer in a list of its own; a key
says that the service still waits for it, and expires with the service's patience.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from lippmann.job.messages.events import Failure, Name, Seconds, Text, WorkerName
from lippmann.job.resolved import ResolvedJob

MAX_ORDER_BYTES = 8_000_000
"""The limit of the order of a preview, which holds a whole job."""
MAX_ANSWER_BYTES = 32_000_000
"""The limit of an answer; the pictures of 2 million pixels have at most 10 MB as base64."""
MAX_PNG = 24_000_000
"""The limit of one picture as base64."""
MAX_NOTES = 100
"""The greatest number of notes of an answer."""

PreviewId = Annotated[str, Field(pattern=r"^[0-9a-f]{32}$")]
"""The id of a preview."""


class PreviewOrder(BaseModel):
    """The order of one preview."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    id: PreviewId
    worker: WorkerName
    """The worker that the order is for."""
    job: ResolvedJob
    """The job at the frame, with the rig of the preview."""
    frame: int
    timeout_s: float = Field(gt=0)
    """The time that the preview may take, s; the worker may have a lower limit."""
    store_id: str | None = None
    """The id of the farm's artifact store, as in an `Order`."""


class PreviewMade(BaseModel):
    """The two pictures of a preview, and what they cost."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    integral_png: str = Field(max_length=MAX_PNG)
    """The orthoscopic integral image as base64."""
    integral_size: tuple[int, int]
    """Its (rows, cols)."""
    view_png: str = Field(max_length=MAX_PNG)
    """The view in the middle as base64."""
    view_size: tuple[int, int]
    """Its (rows, cols)."""
    start_s: Seconds
    render_s: Seconds
    pictures_s: Seconds
    cpu_s: Seconds
    notes: Annotated[tuple[Text, ...], Field(max_length=MAX_NOTES)] = ()


class PreviewAnswer(BaseModel):
    """The answer of a worker to the order of a preview."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    id: PreviewId
    worker: WorkerName
    instance: Name | None = None
    """The start of the worker process, as in an event."""
    made: PreviewMade | None = None
    failure: Failure | None = None
    """The reason why there are no pictures."""
