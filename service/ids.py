"""Names of jobs, tasks and attempts."""

from __future__ import annotations

import secrets

from service.errors import NotFound

_DIGITS = "0123456789abcdefghjkmnpqrstvwxyz"
_TIME_DIGITS = 9
_RANDOM_DIGITS = 8


def new_job_id(now_s: float) -> str:
    """Return a name that sorts by time: 9 digits of milliseconds, 8 of chance."""
    rest, digits = int(now_s * 1000), ""
    for _ in range(_TIME_DIGITS):
        rest, digit = divmod(rest, len(_DIGITS))
        digits = _DIGITS[digit] + digits
    return digits + "".join(secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS))


def is_job_id(name: str) -> bool:
    """Return whether a name is one that `new_job_id` gives.

    >>> is_job_id("scenes")
    False
    """
    return len(name) == _TIME_DIGITS + _RANDOM_DIGITS and set(name) <= set(_DIGITS)


def new_attempt() -> str:
    """Return a token that nobody guesses and nothing repeats."""
    return secrets.token_hex(12)


def task_id(job_id: str, sequence: int) -> str:
    """Return the name of a task.

    >>> task_id("01h", 7)
    '01h-7'
    """
    return f"{job_id}-{sequence}"


def parse_task_id(text: str) -> tuple[str, int]:
    """Return (job, sequence); the inverse of `task_id`.

    Raises
    ------
    NotFound
        If no task has such a name.
    """
    job_id, dash, digits = text.rpartition("-")
    if not (dash and job_id and digits.isascii() and digits.isdigit() and len(digits) <= 18):
        raise NotFound(f"there is no task {text!r}")
    return job_id, int(digits)
