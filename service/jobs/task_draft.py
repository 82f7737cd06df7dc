"""A task in memory: rules change it, and the changes of many tasks are written together. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import HELD_TASKS, TASK_TRANSITIONS, TaskStatus
from service.db.task_state import TaskState

_FIELDS = frozenset(TaskState._fields)


@dataclass
class TaskDraft:
    """A task as it was read, as it is now, and the columns to write."""

    read: TaskState
    now: TaskState = field(init=False)
    values: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.now = self.read

    def set(self, **values: Any) -> None:
        """Change columns of the task other than its status."""
        self.values |= values
        self.now = self.now._replace(**{name: value for name, value in values.items() if name in _FIELDS})

    def transition(self, to: TaskStatus, **values: Any) -> None:
        """Change the status of the task, and other columns with it.

        Raises
        ------
        ValueError
            If the table of transitions does not allow the change.
        """
        check_transition(self.now.status, to)
        self.set(status=to, **values)

    @property
    def has_ended_attempt(self) -> bool:
        """True if the attempt that owned the task when it was read has ended without the task being done."""
        return self.read.status in HELD_TASKS and self.now.status not in (*HELD_TASKS, TaskStatus.DONE)

    def is_newly(self, status: TaskStatus) -> bool:
        """Return whether the task has a status that it did not have when it was read."""
        return self.now.status is status is not self.read.status

    def gains(self) -> dict[str, float]:
        """Return what the change adds to the counters of the job, by the name of the column."""
        was, to = self.read.status, self.now.status
        if was is to:
            return {}
        gains: dict[str, float] = {was.value: -1, to.value: 1}
        if self.is_newly(TaskStatus.DONE):
            gains |= {name: self.values.get(name) or 0.0 for name in ("cpu_s", "wall_s")}
            gains |= {"done_px": self.now.weight_px, "frames_done": int(self.now.kind is TaskKind.ASSEMBLE)}
            if self.values.get("cached"):
                gains |= {"cache_hits": 1, "cached_px": self.now.weight_px}
            gains["artifact_bytes"] = self.now.stored_bytes - self.read.stored_bytes
        return gains


def check_transition(was: TaskStatus, to: TaskStatus) -> None:
    """Raise ValueError if the table of transitions does not allow a change of status."""
    if to not in TASK_TRANSITIONS[was]:
        raise ValueError(f"expected a transition of the table, got task {was} -> {to}")
