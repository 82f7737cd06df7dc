"""A frame of a job."""

from __future__ import annotations

from lippmann.job.states import FrameStatus
from service.schemas.answer import Answer


class Frame(Answer):
    """A frame, with the paths of its pictures once it is done."""

    frame: int
    status: FrameStatus
    thumb: str | None
    """The path of the thumbnail."""
    integral: str | None
    """The path of the integral image as captured, pseudoscopic."""
    orthoscopic: str | None
    """The path of the orthoscopic integral image."""
    views: str | None
    """The path of all views as one picture."""


class FramePage(Answer):
    """A page of frames, in order."""

    items: tuple[Frame, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""


class FrameRun(Answer):
    """Frames of one status that follow each other in the same step: `first`, `first` + `step` … `last`."""

    status: FrameStatus
    first: int
    last: int
    step: int


class FrameStatuses(Answer):
    """The statuses of all frames of a job, in order."""

    runs: tuple[FrameRun, ...]
