"""A frame of a job."""

from __future__ import annotations

from enum import StrEnum

from service.schemas.answer import Answer


class FrameStatus(StrEnum):
    """Where a frame stands."""

    WAITING = "waiting"
    RENDERING = "rendering"
    DONE = "done"
    FAILED = "failed"


class Frame(Answer):
    """A frame, and where its pictures are once it is done."""

    frame: int
    status: FrameStatus
    thumb: str | None
    integral: str | None
    orthoscopic: str | None
    views: str | None


class FramePage(Answer):
    """Frames in order."""

    items: tuple[Frame, ...]
    next_cursor: str | None
