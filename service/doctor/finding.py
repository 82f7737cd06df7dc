"""The findings of an examination."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

LISTED = 5
"""The largest number of tasks that a message lists."""


class Level(StrEnum):
    """The weight of a finding."""

    ERROR = "error"
    """An invariant does not hold."""
    WARNING = "warning"
    """Something needs attention, or will soon."""
    NOTE = "note"
    """Something to know. The exit code stays 0."""


class Check(StrEnum):
    """The checks, by the name that the command prints."""

    INTEGRITY = "integrity"
    FOREIGN_KEYS = "foreign-keys"
    SCHEMA = "schema"
    STATUS_DOMAIN = "status-domain"
    HELD_TWICE = "held-twice"
    HELD_BY_NOBODY = "held-by-nobody"
    HELD_AFTER_END = "held-after-end"
    STUCK = "stuck"
    TOO_EARLY = "too-early"
    COUNTERS = "counters"
    PROGRESS = "progress"
    USAGE = "usage"
    PLAN = "plan"
    UNPLANNED = "unplanned"
    NOT_ENDED = "not-ended"
    DONE_INCOMPLETE = "done-incomplete"
    COORDINATOR = "coordinator"
    LEADER = "leader"
    IDLE_CLOCK = "idle-clock"
    SILENT = "silent"
    STOPS = "stops"
    WEBHOOKS = "webhooks"
    BUNDLES = "bundles"
    ARTIFACTS = "artifacts"
    ORPHANS = "orphans"
    PARTIAL_FILES = "partial-files"
    SPACE = "space"
    STORE = "store"
    SETTINGS = "settings"
    BROKER = "broker"
    WORKERS = "workers"
    SANDBOX = "sandbox"
    POVRAY = "povray"
    MITSUBA = "mitsuba"
    DISK = "disk"
    GPU = "gpu"
    PACKAGES = "packages"
    FARM = "farm"


@dataclass(frozen=True)
class Finding:
    """One violated invariant."""

    check: Check
    level: Level
    message: str
    """A sentence with what was expected and what was found."""
    job_id: str | None = None
    sequences: tuple[int, ...] = ()
    """The tasks of the job that are concerned."""
    repairable: bool = False

    @property
    def is_bad(self) -> bool:
        """True for an error or a warning."""
        return self.level is not Level.NOTE


def tasks_text(sequences: Sequence[int]) -> str:
    """Return the number of some tasks and the first of them.

    >>> tasks_text([4, 7])
    '2 tasks (4, 7)'
    """
    listed = ", ".join(str(sequence) for sequence in sequences[:LISTED])
    more = ", ..." if len(sequences) > LISTED else ""
    return f"{len(sequences)} task{'s' if len(sequences) != 1 else ''} ({listed}{more})"
