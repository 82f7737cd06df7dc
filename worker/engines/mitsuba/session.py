"""A warm program in the sandbox: start, scene and compiled kernels serve many tasks of one job.

A process of the worker keeps one session at most. It serves one job of one owner, with one bundle and one set of
limits: a task with another `SessionKey` ends it and starts its own. It is also ended by every request that fails, after
`MAX_REQUESTS`, and when nobody asks for `IDLE_S`.
"""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from worker.engines.mitsuba.answers import AnswerReader
from worker.engines.mitsuba.surroundings import PACKAGES, devices_of, environment, readable
from worker.sandbox.conversation import Conversation
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome
from worker.sandbox.results import remove_tree
from worker.sandbox.sandbox import Sandbox

MAX_REQUESTS = 200
"""A session is ended after so many requests, so that what a program leaks does not add up."""
IDLE_S = 60.0
"""A session that nobody asks for this long is ended: its memory is for others."""
PROGRAM_MB = 1024
"""The address space of Python with Mitsuba and LLVM, beside the memory that the job may use."""
PROGRAM = (
    "-c",
    "import runpy, sys; sys.path.insert(0, sys.argv[1]); del sys.argv[1]; "
    "runpy.run_module('worker.engines.mitsuba.inside.program', run_name='__main__', alter_sys=True)",
)
"""The arguments of Python that start the program. The folder of our packages follows, as Python without the user's
settings (-I) has no path from outside; then the variant and the number of threads, which the program reads."""


@dataclass(frozen=True)
class SessionKey:
    """What a session is for; nothing that differs in any of it shares a program."""

    owner: str
    job_id: str
    bundle: str
    """The digest of the scene bundle."""
    limits: Limits
    """The totals, and the CPU seconds of each request."""
    variant: str
    threads: int = 1


class Session:
    """A program that answers, with its folder.

    Parameters
    ----------
    key
        What it is for.
    bundle
        The folder of the scene bundle, which it can read.
    folder
        An empty folder of this process; the program can write one in it.
    sandbox
        What it runs in.
    program
        The arguments of Python that name its program.

    Raises
    ------
    SandboxMissing
        If it cannot be started.
    """

    def __init__(
        self, key: SessionKey, *, bundle: Path, folder: Path, sandbox: Sandbox, program: Sequence[str] = PROGRAM
    ) -> None:
        self.key = key
        self.bundle = bundle.resolve()
        self.folder = folder.resolve()
        self.work = self.folder / "work"
        self.requests = 0
        self.work.mkdir()
        library = _library(self.folder / "library")
        python = Path(sys.prefix).resolve() / "bin" / Path(sys.executable).name
        argv = [str(python), "-I", "-B", *program, str(library), key.variant, str(key.threads)]
        # The kernel counts the address space of one process and its CPU seconds from its start.
        of_program = replace(
            key.limits, memory_mb=key.limits.memory_mb + PROGRAM_MB, cpu_s=key.limits.cpu_s * MAX_REQUESTS
        )
        self._conversation = Conversation(
            sandbox.wrap(
                argv,
                readable=[*readable(PACKAGES), library, self.bundle],
                writable=self.work,
                limits=of_program,
                devices=devices_of(key.variant),
            ),
            cwd=self.work,
            env=environment(key.variant),
            limits=key.limits,
            groups=sandbox.groups,
        )

    @property
    def is_open(self) -> bool:
        """True if it can be asked once more."""
        return self._conversation.is_open and self.requests < MAX_REQUESTS

    def ask(
        self,
        request: str,
        reader: AnswerReader,
        *,
        times: TimeLimits,
        on_progress: Callable[[float], None],
        should_stop: Callable[[], bool],
        log: AttemptLog,
    ) -> Outcome[float]:
        """Ask once; see `Conversation.ask`."""
        self.requests += 1
        return self._conversation.ask(
            request, times=times, reader=reader, on_progress=on_progress, should_stop=should_stop, log=log
        )

    def tidy(self) -> None:
        """Remove what the program left in its folder, unread."""
        for path in self.work.iterdir():
            remove_tree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)

    def close(self) -> None:
        """End the program."""
        self._conversation.close()


class Slot:
    """The place of the one session that a process keeps."""

    def __init__(self, *, idle_s: float = IDLE_S) -> None:
        self._idle_s = idle_s
        self._lock = threading.RLock()
        self._session: Session | None = None
        self._kept = ExitStack()
        self._pid = os.getpid()
        self._timer: threading.Timer | None = None

    @contextmanager
    def session(
        self,
        key: SessionKey,
        *,
        bundle: Callable[[], AbstractContextManager[Path]],
        folder: Callable[[], AbstractContextManager[Path]],
        sandbox: Sandbox,
        program: Sequence[str] = PROGRAM,
    ) -> Iterator[Session]:
        """Yield the session for a key, to one user at a time; an error ends it.

        Parameters
        ----------
        key
            What the session is for. Another one is ended first.
        bundle, folder
            Open the folder of the bundle and an empty folder; both are kept open as long as the session lives.
        sandbox
            What its program runs in.
        program
            The arguments of Python that name its program.

        Raises
        ------
        SandboxMissing
            If it cannot be started.
        """
        with self._lock:
            session = self._found(key, bundle, folder, sandbox, program)
            try:
                yield session
            except BaseException:
                self.end()
                raise
            self._rest(session)

    def end(self) -> None:
        """End the session, if there is one: before other work, and when the process ends."""
        with self._lock:
            if self._timer:
                self._timer.cancel()
            kept, self._kept, self._session = self._kept, ExitStack(), None
            # A process that was forked from this one has no session of its own.
            if self._pid == os.getpid():
                kept.close()
            self._pid = os.getpid()

    def _found(
        self,
        key: SessionKey,
        bundle: Callable[[], AbstractContextManager[Path]],
        folder: Callable[[], AbstractContextManager[Path]],
        sandbox: Sandbox,
        program: Sequence[str],
    ) -> Session:
        if self._timer:
            self._timer.cancel()
        found = self._session
        if found and found.key == key and found.is_open and self._pid == os.getpid():
            return found
        self.end()
        with ExitStack() as opened:
            files, own = opened.enter_context(bundle()), opened.enter_context(folder())
            session = Session(key, bundle=files, folder=own, sandbox=sandbox, program=program)
            opened.callback(remove_tree, session.work)
            opened.callback(session.close)
            self._kept = opened.pop_all()
        self._session = session
        return session

    def _rest(self, session: Session) -> None:
        if not session.is_open:
            self.end()
            return
        self._timer = threading.Timer(self._idle_s, self._end_idle, [session, session.requests])
        self._timer.daemon = True
        self._timer.start()

    def _end_idle(self, session: Session, requests: int) -> None:
        with self._lock:
            if self._session is session and session.requests == requests:
                self.end()


slot = Slot()
"""The slot of this process."""
atexit.register(slot.end)


def _library(folder: Path) -> Path:
    """Return a folder with names for our packages: of the folder that they are in, nothing else can be read."""
    folder.mkdir()
    for package in PACKAGES:
        (folder / package.name).symlink_to(package)
    return folder
