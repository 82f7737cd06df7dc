"""A frame of a job."""

from __future__ import annotations

from enum import StrEnum

from service.schemas.answer import Answer


class FrameStatus(StrEnum):
    """Where a frame stands.

    `waiting`: nothing of it is being made, because nothing was begun or because the job has ended without it.
    `rendering`: some of its tasks run or are done. `done`: its pictures are there. `failed`: one of its tasks has
    failed.
    """

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
