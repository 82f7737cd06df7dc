"""A process that makes pictures: `python -m service.viewing.picture_process DESCRIPTOR PARENT`.

`service.viewing.process_pool` starts it and speaks with it over a socket: `Pictures` and the room for sheets first, and
then one picture after the other.

| the service sends | the process answers |
|---|---|
| what is wanted | `PATH`, if its artifact is not in memory |
| the path of the artifact | |
| None in place of a path | nothing; the next request follows |
| | `PICTURE` and a file, `PROBLEM` and its JSON, or `TOO_LARGE` |

The service unpickles nothing that comes from here. The process ends when the service closes the socket, and at once
when the service dies.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from lippmann.errors import LippmannError
from lippmann.logs import trace_of
from service.errors import ServiceError, problems_in
from service.viewing.render import Wanted
from service.viewing.sheet_cache import SheetCache

PATH, PICTURE, PROBLEM, TOO_LARGE = b"path", b"pict", b"prob", b"huge"
"""The kinds of answers; the first four bytes of one."""
KIND_BYTES = 4
NICENESS = 10
"""The niceness of the process above that of the service, once it has started; somebody waits for the start."""
_PR_SET_PDEATHSIG = 1


class _PathMissing(Exception):
    """The service has no path for an artifact, and has answered the request itself."""


def main() -> None:
    """Make pictures until the service needs no more."""
    descriptor, parent = map(int, sys.argv[1:])
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # The service died before the call.
        return
    with Connection(descriptor) as connection:
        try:
            _serve(connection)
        except (EOFError, ConnectionError):
            return


def _serve(connection: Connection[Any, Any]) -> None:
    pictures, room_bytes = connection.recv()
    os.nice(NICENESS)
    sheets = SheetCache(pictures, room_bytes=room_bytes)

    def local_path() -> Path:
        connection.send_bytes(PATH)
        path = connection.recv()
        if path is None:
            raise _PathMissing
        return Path(path)

    while True:
        wanted: Wanted = connection.recv()
        try:
            answer = PICTURE + wanted.make(pictures, sheets, local_path)
        except _PathMissing:
            continue
        except MemoryError:
            answer = TOO_LARGE
        except Exception as error:  # the outermost frame of a picture
            answer = PROBLEM + _problem(error)
        connection.send_bytes(answer)


def _problem(error: Exception) -> bytes:
    if not isinstance(error, ServiceError | LippmannError):
        return json.dumps({"trace": trace_of(error)}).encode()
    problems = [vars(problem) for problem in problems_in(error)]
    return json.dumps({"code": error.code, "message": error.message, "problems": problems}).encode()


if __name__ == "__main__":
    main()
