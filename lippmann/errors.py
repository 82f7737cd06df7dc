"""What a command cannot do, and the exit codes.

The docstring of a class is its default message.
"""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What a command's exit says to the program that called it."""

    DONE = 0
    """It did what was asked."""
    FAILED = 1
    """The job failed or was cancelled, or the service or this machine could not do it."""
    BAD_INPUT = 2
    """What was asked cannot be: an option, a file, a field of a job, a folder, a port."""
    UNREACHABLE = 3
    """The service does not answer."""
    NOT_ALLOWED = 4
    """There is no key, the key is not known, or its role is too low."""
    INTERRUPTED = 130
    """Ctrl-C."""


class LippmannError(Exception):
    """The command could not do what was asked."""

    exit_code = ExitCode.FAILED

    def __init__(self, message: str | None = None) -> None:
        super().__init__(message or (type(self).__doc__ or "").strip())

    @property
    def message(self) -> str:
        """The sentence a user reads."""
        return str(self.args[0])


class BadInput(LippmannError):
    """What was asked cannot be."""

    exit_code = ExitCode.BAD_INPUT


class Unreachable(LippmannError):
    """The service does not answer."""

    exit_code = ExitCode.UNREACHABLE


class NotAllowed(LippmannError):
    """This key may not do that."""

    exit_code = ExitCode.NOT_ALLOWED


class JobEnded(LippmannError):
    """The job ended without being done."""


class FarmFailed(LippmannError):
    """The one-machine farm cannot run."""
