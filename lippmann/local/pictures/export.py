"""Make outputs of masters on this machine, by the makers that a worker runs."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from lippmann.errors import BadInput, InvalidText, LippmannError, SpecError
from lippmann.job.animation.frames import parse_frames
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.outputs.choice import Output, check_names, check_options
from lippmann.job.outputs.output import OutputOptions
from lippmann.local.files.frame_source import files_frames
from lippmann.local.files.job_masters import job_masters
from lippmann.local.files.writable import check_writable
from lippmann.plan import artifact_names as names
from lippmann.terminal.progress import ProgressLine
from lippmann.untrusted.json_text import read_json
from lippmann.untrusted.shown import shown
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import make_output
from worker.whole_file import new_file

if TYPE_CHECKING:
    from lippmann.client import Client


@dataclass(frozen=True)
class ExportResult:
    """The files of one output, or why it could not be made."""

    output: str
    """The file name of the output."""
    files: tuple[Path, ...]
    """The files, the sidecar first."""
    error: str | None = None
    """The reason why it could not be made."""


@contextmanager
def frames_of_job(client: Client, job_id: str, *, frames: str | None) -> Iterator[FrameSource]:
    """Yield the frames of a job, whose masters are fetched into a temporary folder.

    Parameters
    ----------
    client
        The client of the service.
    job_id
        The id of the job.
    frames
        The frames, as in a job file; None for all.
    """
    job = client.job(job_id)
    numbers = job.spec.frame_numbers if frames is None else parse_frames(frames)
    with job_masters(client, job, numbers, depth=True) as folder:
        yield files_frames(folder, fps=job.fps, display=job.spec.display)


def read_outputs(written: Sequence[str]) -> tuple[OutputOptions, ...]:
    """Read outputs, each written as the name of a file or as JSON, without the frames that they are made from.

    Raises
    ------
    BadInput
        If the JSON of an output is invalid.
    SpecError
        If there is no such output, or an option cannot be; the error names every one.
    """
    try:
        outputs = TypeAdapter(tuple[Output, ...]).validate_python([_read(text) for text in written])
        check_names(outputs)
    except ValidationError as error:
        problems = (replace(problem, field=f"outputs.{problem.field}") for problem in problems_of(error))
        raise SpecError.of(problems) from error
    except FieldError as error:
        raise BadInput(f"{error.field}: expected {error.expected}, got {error.got}") from error
    return outputs


def parse_outputs(written: Sequence[str], source: FrameSource) -> tuple[OutputOptions, ...]:
    """Read outputs and check their options against the frames.

    Parameters
    ----------
    written
        The outputs, as in `read_outputs`.
    source
        The frames that they are made from.

    Raises
    ------
    BadInput, SpecError
        As in `read_outputs`, and if an option does not fit the frames.
    """
    outputs = read_outputs(written)
    try:
        check_options(
            outputs,
            source.rig(source.frames[0]),
            source.frames,
            has_depth=source.has_depth,
            viewing_distance_mm=source.display.viewing_distance_mm,
        )
    except FieldError as error:
        raise BadInput(f"{error.field}: expected {error.expected}, got {error.got}") from error
    return outputs


def _read(text: str) -> Any:
    if not text.lstrip().startswith("{"):
        return text
    try:
        return read_json(text, field="output")
    except InvalidText as error:
        raise BadInput(f"expected an output as a file name or as JSON, got {shown(text)}: {error}") from error


def export_outputs(source: FrameSource, outputs: Sequence[OutputOptions], out: Path) -> tuple[ExportResult, ...]:
    """Make outputs into a folder, named as those of a job; one that fails does not stop the others.

    Parameters
    ----------
    source
        The frames that they are made from.
    outputs
        The outputs.
    out
        The folder.
    """
    check_writable(out)
    return tuple(_export(source, output, out) for output in outputs)


def _export(source: FrameSource, output: OutputOptions, out: Path) -> ExportResult:
    made: list[Path] = []

    def put(name: str, path: Path) -> None:
        target = out / name
        target.parent.mkdir(parents=True, exist_ok=True)
        beside = target.with_name(f".{target.name}.part")
        with path.open("rb") as source, new_file(beside) as file:
            shutil.copyfileobj(source, file, 1 << 20)
        beside.replace(target)
        made.append(target)

    with tempfile.TemporaryDirectory(prefix="lippmann-export-") as folder, ProgressLine(output.file_name) as line:
        context = OutputContext(
            source=source, output=output, scratch=Path(folder), put=put, exists=lambda name: False,
            monitor=_LineWatch(line),
        )  # fmt: skip
        try:
            # A sidecar of an earlier export would list files of two exports if this one stops half-way.
            (out / names.sidecar_name(output)).unlink(missing_ok=True)
            make_output(context)
        except LippmannError as error:
            return ExportResult(output=output.file_name, files=tuple(made), error=error.message)
        except OSError as error:
            message = f"cannot write {error.filename or out}: {error.strerror}"
            return ExportResult(output=output.file_name, files=tuple(made), error=message)
    sidecar = out / names.sidecar_name(output)
    return ExportResult(output=output.file_name, files=(sidecar, *(path for path in made if path != sidecar)))


class _LineWatch:
    """A progress monitor that shows the progress on a line; only Ctrl-C stops the work."""

    def __init__(self, line: ProgressLine) -> None:
        self._line, self._progress = line, 0.0

    @property
    def progress(self) -> float:
        """The progress, 0 to 1."""
        return self._progress

    @progress.setter
    def progress(self, fraction: float) -> None:
        self._progress = fraction
        self._line.show(fraction, "")

    def should_stop(self) -> bool:
        """Return False: nothing but Ctrl-C stops an export."""
        return False

    def announce_end(self) -> None:
        """Do nothing: no other attempt waits for the core."""
