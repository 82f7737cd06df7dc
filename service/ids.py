"""The ids of jobs, tasks and attempts."""

from __future__ import annotations

import secrets

from service.errors import NotFound

_DIGITS = "0123456789abcdefghjkmnpqrstvwxyz"
_TIME_DIGITS = 9
_RANDOM_DIGITS = 8


def new_job_id(now_s: float) -> str:
    """Create the id of a job, which sorts by time: 9 digits of milliseconds and 8 random digits."""
    rest, digits = int(now_s * 1000), ""
    for _ in range(_TIME_DIGITS):
        rest, digit = divmod(rest, len(_DIGITS))
        digits = _DIGITS[digit] + digits
    return digits + "".join(secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS))


def is_job_id(name: str) -> bool:
    """Return whether a name has the form of the ids that `new_job_id` creates.

    >>> is_job_id("scenes")
    False
    """
    return len(name) == _TIME_DIGITS + _RANDOM_DIGITS and set(name) <= set(_DIGITS)


def new_attempt() -> str:
    """Create the id of an attempt, which cannot be guessed and never repeats."""
    return secrets.token_hex(12)


def task_id(job_id: str, sequence: int) -> str:
    """Return the id of a task.

    >>> task_id("01h", 7)
    '01h-7'
    """
    return f"{job_id}-{sequence}"


def parse_task_id(text: str) -> tuple[str, int]:
    """Return (job, sequence); the inverse of `task_id`.

    Raises
    ------
    NotFound
        If no task can have this id.
    """
    job_id, dash, digits = text.rpartition("-")
    if not (dash and job_id and digits.isascii() and digits.isdigit() and len(digits) <= 18):
        raise NotFound(f"there is no task {text!r}")
    return job_id, int(digits)
