"""Logs: tracebacks are bounded, and local variables stay out of them."""

from __future__ import annotations

import errno
import io
import json
import logging
import subprocess
import sys
from collections.abc import Iterator

import pytest
import structlog

from lippmann.logs import MAX_CHAIN, MAX_MESSAGE, MAX_TEXT, LogFormat, configure_logs, trace_of
from tests.waiting import ENOUGH_S


@pytest.fixture
def logs() -> Iterator[None]:
    """Restore the configuration of this process, which the tests change."""
    root, config = logging.getLogger(), structlog.get_config()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)
    structlog.configure(**config)


def fail(depth: int, message: str) -> None:
    secret = "the key of " + "the admin"
    if depth:
        fail(depth - 1, message)
    raise ValueError(message) if secret else AssertionError


def caught(depth: int = 0, message: str = "a fault") -> Exception:
    try:
        fail(depth, message)
    except ValueError as error:
        return error
    raise AssertionError


def test_a_traceback_names_the_place_and_the_error() -> None:
    trace = trace_of(caught())
    assert "test_logs.py" in trace
    assert "in fail" in trace
    assert trace.endswith("builtins.ValueError: a fault")


def test_a_traceback_of_a_deep_recursion_has_its_innermost_frames_only() -> None:
    trace = trace_of(caught(depth=500))
    assert "in caught" not in trace
    assert len(trace) < 5000


def test_a_chain_of_errors_is_cut_at_its_oldest() -> None:
    newest = ValueError("fault 0")
    link: BaseException = newest
    for number in range(1, 10_000):
        link.__cause__ = ValueError(f"fault {number}")
        link = link.__cause__
    trace = trace_of(newest)
    assert trace.startswith("(more exceptions came before)")
    assert trace.endswith("ValueError: fault 0")
    assert f"fault {MAX_CHAIN - 1}" in trace
    assert f"fault {MAX_CHAIN}" not in trace


def test_a_long_message_is_cut() -> None:
    assert len(trace_of(ValueError("x" * 10**6))) < MAX_MESSAGE + 200


def test_an_error_whose_message_fails_is_named() -> None:
    class Broken(Exception):
        def __str__(self) -> str:
            raise RuntimeError

    assert trace_of(Broken()).endswith("Broken: (its message cannot be shown: RuntimeError)")


def _logged(log_format: LogFormat, *, by_library: bool) -> str:
    file = io.StringIO()
    configure_logs(file, log_format=log_format)
    try:
        fail(1, "a fault")
    except ValueError:
        if by_library:
            logging.getLogger("celery").exception("a task %s", "failed")
        else:
            structlog.get_logger().error("a task failed", exc_info=True, code="x" * 10**6)
    return file.getvalue()


@pytest.mark.usefixtures("logs")
@pytest.mark.parametrize("by_library", [False, True])
def test_a_plain_log_has_the_traceback_without_local_variables(by_library: bool) -> None:
    text = _logged("plain", by_library=by_library)
    assert "a task failed" in text
    assert text.count("ValueError: a fault") == 1
    assert "in fail" in text
    assert "the key of the admin" not in text
    assert len(text) < MAX_TEXT + 3000


@pytest.mark.usefixtures("logs")
@pytest.mark.parametrize("by_library", [False, True])
def test_a_json_log_is_one_object_a_line(by_library: bool) -> None:
    (line,) = _logged("json", by_library=by_library).splitlines()
    entry = json.loads(line)
    assert (entry["event"], entry["level"]) == ("a task failed", "error")
    assert entry["exception"].endswith("ValueError: a fault")
    assert "the key of the admin" not in line


@pytest.mark.usefixtures("logs")
def test_every_line_has_the_fields_of_its_process_and_the_ids_of_what_is_done_meanwhile() -> None:
    file = io.StringIO()
    configure_logs(file, log_format="json", fields={"worker": "w1", "job": "of the process"})
    with structlog.contextvars.bound_contextvars(job="j", attempt="a"):
        structlog.get_logger().warning("ours")
        logging.getLogger("celery").warning("of a library")
    structlog.get_logger().warning("after")
    first, second, last = map(json.loads, file.getvalue().splitlines())
    assert all((line["worker"], line["job"], line["attempt"]) == ("w1", "j", "a") for line in (first, second))
    assert (last["worker"], last["job"], "attempt" in last) == ("w1", "of the process", False)


_FORKED = """
import io, os, sys, threading
import structlog
from lippmann.logs import configure_logs

class Slow(io.StringIO):
    def write(self, text):
        begun.set()
        free.wait()
        return sys.stdout.write(text)

begun, free = threading.Event(), threading.Event()
configure_logs(Slow())
log = structlog.get_logger()
threading.Thread(target=log.info, args=("of a thread",)).start()
begun.wait()
threading.Timer(0.2, free.set).start()
child = os.fork()
if child == 0:
    free.set()
    log.info("of the child")
    sys.stdout.flush()
    os._exit(0)
os.waitpid(child, 0)
"""


def test_a_process_that_was_forked_while_a_thread_wrote_can_log() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", _FORKED], capture_output=True, text=True, timeout=ENOUGH_S, check=True
    )
    assert "of the child" in ended.stdout


class FullDisk(io.StringIO):
    def write(self, text: str, /) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.usefixtures("logs")
def test_a_log_that_cannot_be_written_holds_up_no_work() -> None:
    configure_logs(FullDisk())
    structlog.get_logger().info("lost")
