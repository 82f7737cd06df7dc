"""Logs of the service and the workers: plain lines or JSON, with bounded tracebacks and without local variables."""

from __future__ import annotations

import logging
import os
import sys
import threading
import traceback
from collections.abc import Iterator, Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Literal, TextIO

import structlog
from structlog.typing import EventDict, Processor, WrappedLogger

LogFormat = Literal["plain", "json"]

MAX_CHAIN = 5
"""The greatest number of exceptions of a chain in a traceback; the newest stand last."""
MAX_FRAMES = 20
"""The greatest number of frames of an exception in a traceback, the innermost ones."""
MAX_MESSAGE = 2000
MAX_TEXT = 20_000
"""The greatest length of any text of a log entry."""


def trace_of(error: BaseException) -> str:
    """Return the traceback of an error and of what caused it, oldest first, in bounded time and length.

    A traceback of the standard library follows every frame of every exception of a chain, and other formatters add the
    local variables, which may hold keys.
    """
    links = list(_chain(error))
    text = "\n".join(_trace_of_one(link) for link in reversed(links[:MAX_CHAIN]))
    return _cut(f"(more exceptions came before)\n{text}" if len(links) > MAX_CHAIN else text, MAX_TEXT)


def configure_logs(
    file: TextIO, *, log_format: LogFormat = "plain", fields: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Write the logs of this process to a file, those of libraries included.

    Parameters
    ----------
    file
        The file.
    log_format
        `plain` for lines that a person reads, or `json` for one JSON object a line.
    fields
        What every line says, such as the name of the worker.
    """

    def add_fields(_logger: WrappedLogger, _name: str, event: EventDict) -> EventDict:
        return {**fields, **event}

    shared: list[Processor] = [
        structlog.contextvars.merge_contextvars,
        add_fields,
        structlog.processors.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        _add_trace,
        _cut_texts,
    ]
    # The renderer formats no error itself: the text of the traceback is there already.
    plain = structlog.dev.ConsoleRenderer(colors=False, exception_formatter=structlog.dev.plain_traceback)
    render: Processor = structlog.processors.JSONRenderer(default=repr) if log_format == "json" else plain
    structlog.configure(processors=[*shared, render], logger_factory=lambda *_: _Lines(file))
    handler = logging.StreamHandler(file)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=[structlog.stdlib.add_logger_name, *shared],
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, render],
        )
    )
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.INFO)


_writing = threading.Lock()
# A worker forks while its threads write; without this, the new process would wait for ever for one of them.
os.register_at_fork(before=_writing.acquire, after_in_parent=_writing.release, after_in_child=_writing.release)


class _Lines:
    """A logger that writes entries to a file, one at a time, whose lock is free in a process that was forked."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def msg(self, entry: str) -> None:
        # The work goes on though its log is on a full disk, or on a terminal that was closed.
        with _writing, suppress(OSError):
            print(entry, file=self._file, flush=True)

    debug = info = warning = error = critical = msg


def _chain(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and what caused it, newest first, and one more than the limit if there are more."""
    link: BaseException | None = error
    for _ in range(MAX_CHAIN + 1):
        if link is None:
            return
        yield link
        link = link.__cause__ or (None if link.__suppress_context__ else link.__context__)


def _trace_of_one(error: BaseException) -> str:
    frames = traceback.StackSummary.extract(
        traceback.walk_tb(error.__traceback__), limit=-MAX_FRAMES, capture_locals=False
    )
    kind = f"{type(error).__module__}.{type(error).__qualname__}"
    return f"Traceback, innermost frame last:\n{''.join(frames.format())}{kind}: {_message(error)}"


def _message(error: BaseException) -> str:
    try:
        return _cut(str(error), MAX_MESSAGE)
    except Exception as fault:
        return f"(its message cannot be shown: {type(fault).__name__})"


def _add_trace(_logger: WrappedLogger, _name: str, event: EventDict) -> EventDict:
    """Replace the error of an entry by the text of its traceback."""
    given = event.pop("exc_info", None)
    error = sys.exception() if given is True else given[1] if isinstance(given, tuple) else given
    if isinstance(error, BaseException):
        event["exception"] = trace_of(error)
    return event


def _cut_texts(_logger: WrappedLogger, _name: str, event: EventDict) -> EventDict:
    return {name: _cut(value, MAX_TEXT) if isinstance(value, str) else value for name, value in event.items()}


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 3]}..."
