"""The errors of the library, the command, the client and the workers.

There are two families. A `Transient` failure may be gone at the next attempt, on this worker or on another; a
`Permanent` one is the same every time, so it is not tried again. The docstring of a class is its default message, and
its `code` is the name by which events, problem details and exit codes refer to it.
"""

from __future__ import annotations

import errno
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

NO_DISK = frozenset({errno.EROFS, errno.EIO, errno.ENODEV, errno.ENXIO, errno.ESTALE, errno.ENOTCONN, errno.EACCES})
"""The errors of the system when a disk cannot be written: mounted read-only, broken, or away."""

NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""The errors of the system when there is no room: on the disk, in the quota, below the limit of a file's size."""


class InputNote(UserWarning):
    """A note for the user on a file that was read; it is no error."""


class LippmannError(Exception):
    """The operation failed."""

    code = "error"

    def __init__(self, message: str | None = None) -> None:
        super().__init__(message or (type(self).__doc__ or "").strip())

    @property
    def message(self) -> str:
        """The sentence a user reads."""
        return str(self.args[0])


class Transient(LippmannError):
    """A failure that another attempt may not meet."""

    code = "transient"


class Permanent(LippmannError):
    """A failure that every attempt would meet."""

    code = "permanent"


MAX_PROBLEMS = 50
"""The greatest number of problems that an error reports one by one."""
MAX_TEXT = 2000
"""The greatest length of each text of a problem."""


@dataclass(frozen=True)
class FieldProblem:
    """A field of the input that is invalid: its name, the expected value and the given one; long texts are cut."""

    field: str
    expected: str
    got: str

    def __post_init__(self) -> None:
        for name in ("field", "expected", "got"):
            text = getattr(self, name)
            if len(text) > MAX_TEXT:
                object.__setattr__(self, name, text[: MAX_TEXT - 3] + "...")

    def __str__(self) -> str:
        return f"{self.field}: expected {self.expected}, got {self.got}"


def first_problems(problems: Iterable[FieldProblem], *, more: int = 0) -> tuple[FieldProblem, ...]:
    """Return the first problems, and one more that counts the rest; `more` of them are not among those given."""
    kept = tuple(problems)
    if not more and len(kept) <= MAX_PROBLEMS + 1:
        return kept
    rest = f"{len(kept[MAX_PROBLEMS:]) + more:,} more"
    return (*kept[:MAX_PROBLEMS], FieldProblem(field="(whole)", expected="no further problems", got=rest))


class SpecError(Permanent):
    """The job asks for something that cannot be done."""

    code = "spec"
    problems: tuple[FieldProblem, ...] = ()

    @classmethod
    def of(cls, problems: Iterable[FieldProblem]) -> Self:
        """Make the error that reports these problems."""
        kept = first_problems(problems)
        error = cls("; ".join(str(problem) for problem in kept))
        error.problems = kept
        return error


class OpticsError(SpecError):
    """The optics cannot be built."""

    code = "optics"


class LayoutError(Permanent):
    """The pixels do not fit the lens array."""

    code = "layout"


class SceneError(Permanent):
    """POV-Ray refused the scene."""

    code = "scene"


class BundleError(Permanent):
    """The scene bundle is not whole."""

    code = "bundle"


class OutputError(Permanent):
    """An output cannot be made from what was rendered."""

    code = "output"


class RenderFailed(Transient):
    """POV-Ray ended without a picture."""

    code = "render-failed"


class RenderStalled(Transient):
    """POV-Ray made no progress for too long and was ended."""

    code = "render-stalled"


class RenderTimedOut(Transient):
    """POV-Ray ran longer than the job allows and was ended."""

    code = "render-timeout"


class ParseTimedOut(RenderTimedOut):
    """POV-Ray parsed the scene for longer than the job allows and was ended."""

    code = "parse-timeout"


class PhotonsTimedOut(RenderTimedOut):
    """POV-Ray shot photons for longer than the job allows and was ended."""

    code = "photons-timeout"


class RenderCrashed(RenderFailed):
    """POV-Ray was ended by a signal."""

    code = "render-crashed"


class OutOfMemory(RenderFailed):
    """POV-Ray needs more memory than the job allows."""

    code = "out-of-memory"


class SandboxMissing(Transient):
    """This worker has no sandbox, and scenes run in nothing less."""

    code = "sandbox-missing"


class PovrayMissing(Transient):
    """POV-Ray is not installed on this worker."""

    code = "povray-missing"


class MitsubaMissing(Transient):
    """Mitsuba does not work on this worker."""

    code = "mitsuba-missing"


class ScratchDamaged(Transient):
    """Files disappeared from the scratch folder of a worker while it rendered."""

    code = "scratch-damaged"


class WorkerOutdated(Transient):
    """This worker does not know a part of the job, because a newer service wrote it."""

    code = "worker-outdated"


class ArtifactMissing(Transient):
    """An artifact that should be in the store is not there."""

    code = "artifact-missing"
    frame: int | None = None
    """The frame of the artifact, if whoever reads it knows the frame."""
    artifact: str | None = None
    """The name of the artifact below its job, if whoever reads it knows the name."""


class ArtifactBroken(Transient):
    """An artifact in the store cannot be read."""

    code = "artifact-broken"
    frame: int | None = None
    """The frame of the artifact, if whoever reads it knows the frame."""
    artifact: str | None = None
    """The name of the artifact below its job, if whoever reads it knows the name."""


class StoreFull(Transient):
    """There is no room left for artifacts."""

    code = "store-full"


class StoreUnavailable(Transient):
    """The artifact store does not answer."""

    code = "store-unavailable"


class DiskFull(StoreFull):
    """There is no room left on a disk of this machine."""

    code = "disk-full"


class DiskUnavailable(StoreUnavailable):
    """A folder of this machine cannot be written to."""

    code = "disk-unavailable"


class Stopped(Transient):
    """The attempt was told to stop."""

    code = "stopped"


class BadInput(Permanent):
    """The input is invalid."""

    code = "bad-input"


class InvalidText(BadInput):
    """A text is damaged, or larger or deeper than its limits."""

    def __init__(self, problem: FieldProblem) -> None:
        super().__init__(str(problem))
        self.problems = (problem,)


class NotAllowed(Permanent):
    """The key does not permit this operation."""

    code = "not-allowed"


class Unreachable(Transient):
    """The service does not answer."""

    code = "unreachable"


class JobEnded(Permanent):
    """The job ended without being done."""

    code = "job-ended"


class FarmFailed(Transient):
    """The one-machine farm cannot run."""

    code = "farm-failed"
