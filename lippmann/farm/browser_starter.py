"""A process that starts a browser outside a farm: `python -m lippmann.farm.browser_starter DESCRIPTOR`.

At the end of a farm every process below the one that started it is killed, and orphans are among them. The browser of
the user must go on, so it is started by a process that left before that: it became a child of init before the farm
began to adopt orphans.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_MAX_URL_BYTES = 4096
_YES, _NO = b"y", b"n"


@contextmanager
def browser_starter() -> Iterator[Callable[[str], bool]]:
    """Lend a function that opens a browser at a URL, and returns whether there is one.

    The context begins before the farm does. The process waits in it for the URL, and ends with it.
    """
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with here:
        with there:
            command = [sys.executable, "-P", "-m", "lippmann.farm.browser_starter", str(there.fileno())]
            subprocess.run(command, pass_fds=(there.fileno(),), check=False)

        def open_at(url: str) -> bool:
            try:
                here.send(url.encode())
                return here.recv(1) == _YES
            except ConnectionError:  # The process has ended.
                return False

        yield open_at


def main() -> None:
    """Leave the process that started this one, and open a browser at the URL that it sends."""
    if os.fork():
        os._exit(0)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends this process, too, without a traceback.
    with socket.socket(fileno=int(sys.argv[1])) as there:
        there.set_inheritable(False)
        if url := there.recv(_MAX_URL_BYTES).decode():
            _leave_outputs()
            there.send(_YES if webbrowser.open(url) else _NO)


def _leave_outputs() -> None:
    """Leave the outputs that are no terminal: who reads them waits for their end, and the browser outlives the farm."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for output in (sys.stdout, sys.stderr):
        if not output.isatty():
            os.dup2(nowhere, output.fileno())


if __name__ == "__main__":
    main()
