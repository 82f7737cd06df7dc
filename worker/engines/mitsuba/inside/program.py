"""The program in the sandbox: it reads requests from the standard input, renders them and answers, one line each.

    python -m worker.engines.mitsuba.inside.program VARIANT THREADS

It ends with the standard input. The lines of the answers go to the standard output alone; whatever a library prints
goes to the standard error.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol

from lippmann.errors import LippmannError, SceneError
from lippmann.job.resolved import ResolvedJob
from worker.engines.mitsuba.inside.messages import (
    MAX_LINE_BYTES,
    MAX_NOTE,
    MAX_NOTES,
    Failure,
    Progress,
    Request,
    Result,
    UnsupportedError,
    read_request,
)

if TYPE_CHECKING:
    import mitsuba as mi


class Loaded(Protocol):
    """A scene that is loaded."""

    @property
    def scene(self) -> mi.Scene:
        """The scene."""

    @property
    def notes(self) -> tuple[str, ...]:
        """The parts that were left out or replaced."""

    @property
    def names(self) -> Mapping[str, str]:
        """The names of shapes, by their identifiers; see `LoadedScene`."""

    @property
    def reads(self) -> frozenset[str]:
        """The names of clock and stage, as far as the scene depends on them."""


Load = Callable[[Path, ResolvedJob, float], Loaded]
"""The function that loads the scene of a bundle for a job at a frame, and the clock there."""


@dataclass(frozen=True)
class _Kept:
    """A scene that stays loaded, and what it was loaded for."""

    key: tuple[object, ...]
    moving: Mapping[str, object]
    loaded: Loaded


@dataclass
class Program:
    """The loop, and the scenes that it keeps for the next request: one, or two for the channel motion."""

    load: Load
    answers: BinaryIO
    _kept: list[_Kept] = field(default_factory=list, repr=False)

    def serve(self, requests: BinaryIO) -> None:
        """Answer requests until there are no more."""
        while line := requests.readline(MAX_LINE_BYTES + 1):
            try:
                request = read_request(line)
            except ValueError as error:
                self._send(Failure.of(None, "unsupported", str(error)))
                continue
            try:
                self._send(self._answer(request))
            except UnsupportedError as error:
                self._send(Failure.of(request.number, "unsupported", str(error)))
            except LippmannError as error:
                self._send(Failure.of(request.number, "scene", error.message))
            except Exception as error:  # the outermost frame: the next request may be answered
                traceback.print_exc()
                self._send(Failure.of(request.number, "internal", f"{type(error).__name__}: {error}"))

    def _send(self, message: Progress | Result | Failure) -> None:
        self.answers.write(message.line())
        self.answers.flush()

    def _answer(self, request: Request) -> Result:
        """Render a request into files in the working folder."""
        from worker.engines.mitsuba.inside.channels import object_names
        from worker.engines.mitsuba.inside.shade import bands, shade_band

        started_s = time.monotonic()
        loaded, fresh = self._scene(request.bundle, request.job, request.frame, room=1 if request.next_job else 0)
        later = None
        if request.next_job is not None:
            later, is_new = self._scene(request.bundle, request.next_job, request.frame + 1, room=1)
            fresh |= is_new
        loaded_s = time.monotonic()
        cpu_s = time.process_time()
        files = {kind: request.file_name(kind) for kind in request.kinds}
        rendered = 0
        for name in files.values():
            Path(name).unlink(missing_ok=True)
        for rows in bands(request):
            for kind, values in shade_band(loaded.scene, request, rows, later.scene if later else None).items():
                with Path(files[kind]).open("ab") as file:
                    file.write(values.astype("<f4", copy=False).tobytes())
            rendered += len(rows)
            self._send(Progress(progress=rendered / request.shape[0]))
        notes = loaded.notes
        objects: tuple[str, ...] = ()
        if "object" in request.kinds:
            objects, note = object_names(loaded.scene, loaded.names)
            notes = (*notes, note) if note else notes
        return Result(
            number=request.number,
            files=files,
            load_s=loaded_s - started_s if fresh else 0,
            trace_s=time.monotonic() - loaded_s,
            trace_cpu_s=time.process_time() - cpu_s,
            notes=tuple(note[:MAX_NOTE] for note in notes[:MAX_NOTES]),
            objects=objects,
        )

    def _scene(self, bundle: str, job: ResolvedJob, frame: int, *, room: int) -> tuple[Loaded, bool]:
        """Return the scene of a job at a frame, and whether it was loaded for it.

        Parameters
        ----------
        room
            The number of scenes that stay in memory besides it: those that were used last.
        """
        clock = job.clock.at(frame)
        key = (bundle, job.bundle, job.file, tuple(sorted(job.parameters.items())))
        moving = {"clock": clock, "stage": job.stage}
        for kept in self._kept:
            if kept.key == key and all(moving[name] == kept.moving[name] for name in kept.loaded.reads):
                self._kept = [other for other in self._kept if other is not kept][-room:] if room else []
                self._kept.append(kept)
                return kept.loaded, False
        self._kept = self._kept[-room:] if room else []  # the others leave memory first
        try:
            loaded = self.load(Path(bundle), job, clock)
        except LippmannError:
            raise
        except (RuntimeError, OSError, ValueError) as error:  # what Mitsuba and the loaders raise about files
            raise SceneError(f"The scene cannot be loaded: {error}") from error
        self._kept.append(_Kept(key, moving, loaded))
        return loaded, True


def private_answers() -> BinaryIO:
    """Return a stream to the standard output, which from then on is the standard error for everything else."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return answers


def prepare(variant: str, threads: int) -> None:
    """Choose the variant of Mitsuba and the number of threads of Dr.Jit."""
    import drjit
    import mitsuba

    mitsuba.set_variant(variant)
    drjit.set_thread_count(threads)
    mitsuba.set_log_level(mitsuba.LogLevel.Warn)


def main(variant: str, threads: int, load: Load | None = None) -> None:
    """Answer requests from the standard input until it ends.

    Parameters
    ----------
    variant
        The variant of Mitsuba: `llvm_ad_rgb` or `cuda_ad_rgb`.
    threads
        The number of threads of Dr.Jit.
    load
        The function that loads scenes; by default that of `scenes`.
    """
    answers = private_answers()  # before the libraries, whose prints are no answers
    prepare(variant, threads)
    Program(load or _load_of_scenes(), answers).serve(sys.stdin.buffer)


def _load_of_scenes() -> Load:
    from worker.engines.mitsuba.inside.scenes.load import load

    return load


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
