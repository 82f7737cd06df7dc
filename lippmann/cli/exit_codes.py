"""The exit codes of the command, and the one translation of errors into them."""

from __future__ import annotations

from enum import IntEnum

from lippmann.errors import BadInput, BundleError, LayoutError, LippmannError, NotAllowed, SpecError, Unreachable


class ExitCode(IntEnum):
    """The exit codes of the command."""

    DONE = 0
    """The command did what was asked."""
    FAILED = 1
    """The job failed or was cancelled, or the service or this machine could not do it."""
    BAD_INPUT = 2
    """The input is invalid: an option, a file, a field of a job, a folder or a port."""
    UNREACHABLE = 3
    """The service does not answer."""
    NOT_ALLOWED = 4
    """There is no key, the key is not known, or its role is too low."""
    INCOMPLETE = 5
    """The command did what was possible: `fetch` brought the files that there are, and some are missing."""
    INTERRUPTED = 130
    """The user pressed Ctrl-C."""


_EXIT_CODES: tuple[tuple[type[LippmannError], ExitCode], ...] = (
    (NotAllowed, ExitCode.NOT_ALLOWED),
    (Unreachable, ExitCode.UNREACHABLE),
    (BadInput, ExitCode.BAD_INPUT),
    (SpecError, ExitCode.BAD_INPUT),
    (BundleError, ExitCode.BAD_INPUT),
    (LayoutError, ExitCode.BAD_INPUT),
)


def exit_code_of(error: LippmannError) -> ExitCode:
    """Return the exit code that reports an error."""
    return next((code for kind, code in _EXIT_CODES if isinstance(error, kind)), ExitCode.FAILED)
