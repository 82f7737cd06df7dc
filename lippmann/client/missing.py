"""The files that a fetch could not bring: frames and outputs of a job that are not made, or whose files are damaged.

The file `missing.json` beside the files of the job lists them with the reasons, for programs:

    {"job": "01k...", "status": "failed", "error": "2 of 10 tasks failed; the first: ...",
     "frames": [{"frame": 3, "why": "failed", "error": "fish.pov:12: ...", "files": ["integral/0003.exr", ...]}],
     "outputs": [{"output": "views.mp4", "why": "not-begun", "error": null, "files": ["video/views.mp4"]}]}
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path

from lippmann.client import Client
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import FrameStatus, JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.makers import maker_of
from service.schemas.job import Job
from service.schemas.task import Task

MISSING = "missing.json"


class Why(StrEnum):
    """The reason why files of a job are missing."""

    FAILED = "failed"
    RUNNING = "running"
    NOT_BEGUN = "not-begun"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"
    DAMAGED = "damaged"
    """The files were made, and are now missing in the store or damaged there."""


_OF_FRAME = {
    FrameStatus.DONE: Why.DAMAGED,
    FrameStatus.FAILED: Why.FAILED,
    FrameStatus.RENDERING: Why.RUNNING,
    FrameStatus.SKIPPED: Why.SKIPPED,
}
_OF_TASK = {
    TaskStatus.DONE: Why.DAMAGED,
    TaskStatus.FAILED: Why.FAILED,
    TaskStatus.DISPATCHED: Why.RUNNING,
    TaskStatus.RUNNING: Why.RUNNING,
}


@dataclass(frozen=True)
class MissingFrame:
    """A frame of which files are missing."""

    frame: int
    why: Why
    error: str | None
    files: tuple[str, ...]
    """The names of the missing files below the job."""


@dataclass(frozen=True)
class MissingOutput:
    """An output of which files are missing."""

    output: str
    why: Why
    error: str | None
    files: tuple[str, ...]
    """The names of the missing files below the job; at least the file that is stored last."""


@dataclass(frozen=True)
class Missing:
    """Everything that a fetch could not bring."""

    job: str
    status: JobStatus
    error: str | None
    """The reason why the job failed."""
    frames: tuple[MissingFrame, ...] = ()
    outputs: tuple[MissingOutput, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.frames or self.outputs)


@dataclass(frozen=True)
class JobState:
    """A job with its frames and outputs at one moment, which is before its files are listed."""

    job: Job
    frames: Mapping[int, FrameStatus]
    outputs: Mapping[str, Task]
    """The tasks of the outputs; none while the job is not planned."""
    errors: Mapping[int, str]
    """The first error of each frame that failed."""


def read_state(client: Client, job_id: str) -> JobState:
    """Return the present state of a job."""
    job = client.job(job_id)
    frames = {frame.frame: frame.status for frame in client.frames(job_id)}
    outputs = {task.output or "": task for task in client.tasks(job_id, kind=TaskKind.ENCODE)}
    errors: dict[int, str] = {}
    if FrameStatus.FAILED in frames.values():
        for task in client.tasks(job_id, status=TaskStatus.FAILED):
            if task.frame is not None and task.error is not None:
                errors.setdefault(task.frame, task.error.message)
    return JobState(job, frames, outputs, errors)


def find_missing(
    state: JobState,
    fetched: Collection[str],
    damaged: Mapping[str, str],
    *,
    repairing: Collection[str] = (),
    frames: Collection[int] | None,
    kinds: Sequence[str],
    outputs: Collection[str] | None = None,
) -> Missing:
    """Return what is missing of the wanted files of a job.

    Parameters
    ----------
    fetched
        The names of the fetched files below the job.
    damaged
        The names of the files that the service has and does not send, with its messages.
    repairing
        The names of those that the farm makes again.
    frames
        The wanted frames; None for all.
    kinds
        The wanted kinds of masters, such as `integral`.
    outputs
        The wanted outputs by their file names; None for all.
    """
    job = state.job
    wanted = [frame for frame in state.frames if frames is None or frame in frames]
    missing_frames = (_missing_frame(state, frame, fetched, damaged, repairing, kinds) for frame in wanted)
    missing_outputs = (
        _missing_output(state, output.file_name, names.output_name(output), fetched, damaged, repairing)
        for output in job.spec.outputs
        if outputs is None or output.file_name in outputs
    )
    return Missing(
        job=job.id,
        status=job.status,
        error=job.error.message if job.error else None,
        frames=tuple(filter(None, missing_frames)),
        outputs=tuple(filter(None, missing_outputs)),
    )


def _missing_frame(
    state: JobState,
    frame: int,
    fetched: Collection[str],
    damaged: Mapping[str, str],
    repairing: Collection[str],
    kinds: Sequence[str],
) -> MissingFrame | None:
    masters = [name for name in names.masters(state.job.spec, frame) if name.partition("/")[0] in kinds]
    files = tuple(name for name in masters if name not in fetched)
    if not files:
        return None
    why = _OF_FRAME.get(state.frames[frame]) or _not_made(state.job)
    if why is Why.DAMAGED and not set(repairing).isdisjoint(files):
        why = Why.RUNNING
    return MissingFrame(frame, why, state.errors.get(frame) or _first(files, damaged), files)


def _missing_output(
    state: JobState,
    output: str,
    last: str,
    fetched: Collection[str],
    damaged: Mapping[str, str],
    repairing: Collection[str],
) -> MissingOutput | None:
    broken = [name for name in damaged if (maker := maker_of(state.job.spec, name)) and maker.output == output]
    files = tuple(dict.fromkeys([*broken, *([last] if last not in fetched else [])]))
    if not files:
        return None
    task = state.outputs.get(output)
    why = (task and _OF_TASK.get(task.status)) or _not_made(state.job)
    if why is Why.DAMAGED and not set(repairing).isdisjoint(files):
        why = Why.RUNNING
    error = task.error.message if task and task.error and why is Why.FAILED else _first(files, damaged)
    return MissingOutput(output, why, error, files)


def _not_made(job: Job) -> Why:
    return Why.CANCELLED if job.status is JobStatus.CANCELLED else Why.NOT_BEGUN


def _first(files: Sequence[str], damaged: Mapping[str, str]) -> str | None:
    return next((damaged[name] for name in files if name in damaged), None)


def write_missing(folder: Path, missing: Missing) -> None:
    """Write `missing.json`, or remove the one of an earlier fetch if nothing is missing any more."""
    path = folder / MISSING
    if not missing:
        path.unlink(missing_ok=True)
        return
    folder.mkdir(parents=True, exist_ok=True)
    beside = folder / f".{MISSING}.part"
    beside.write_text(json.dumps(asdict(missing), indent=1))
    beside.replace(path)


def missing_text(missing: Missing, folder: Path) -> str:
    """Return one sentence about what is missing."""
    what = [
        f"{len(found)} {word}{'s' if len(found) != 1 else ''} ({_reasons(found)})"
        for word, found in (("frame", missing.frames), ("output", missing.outputs))
        if found
    ]
    verb = "is" if len(missing.frames) + len(missing.outputs) == 1 else "are"
    errors = [*(frame.error for frame in missing.frames), *(output.error for output in missing.outputs), missing.error]
    error = next(filter(None, errors), None)
    first = f"; the first error: {error}" if error else ""
    return (
        f"{' and '.join(what)} of job {missing.job}, which is {missing.status}, {verb} missing, "
        f"as {folder / MISSING} lists{first}"
    )


def _reasons(found: Sequence[MissingFrame | MissingOutput]) -> str:
    counts = Counter(each.why for each in found)
    return ", ".join(f"{counts[why]} {why.value.replace('-', ' ')}" for why in Why if counts[why])
