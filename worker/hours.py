"""The hours in which a worker takes orders, such as `Mon-Fri 19:00-07:00, Sat-Sun 00:00-24:00`.

They are hours of the wall clock of the worker's machine. When a clock is set forward at night, hours that do not exist
are skipped; when it is set back, hours that come twice count twice.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, tzinfo

from lippmann.errors import BadInput

DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
DAY_MIN = 24 * 60
WEEK_MIN = 7 * DAY_MIN
EXPECTED = "hours such as `Mon-Fri 19:00-07:00, Sat-Sun 00:00-24:00`"

_PART = re.compile(r"(?:(?P<first>[A-Za-z]+)(?:-(?P<last>[A-Za-z]+))?\s+)?(?P<begin>\d\d:\d\d)-(?P<end>\d\d:\d\d)")


@dataclass(frozen=True)
class Hours:
    """The hours of a week.

    Parameters
    ----------
    text
        The hours as they were given.
    spans
        Each span as the minute of the week at which it begins, from Monday 00:00, and its length in minutes.
    """

    text: str
    spans: tuple[tuple[int, int], ...]

    def include(self, local: datetime) -> bool:
        """Return whether a time of the wall clock is in these hours.

        >>> parse_hours("Fri 19:00-07:00").include(datetime(2026, 11, 28, 6, 59))  # a Saturday
        True
        """
        minute = local.weekday() * DAY_MIN + local.hour * 60 + local.minute
        return any((minute - begin) % WEEK_MIN < length for begin, length in self.spans)

    def next_begin_s(self, now_s: float, zone: tzinfo | None = None) -> float | None:
        """Return the time at which the hours begin next, in seconds since 1970; None if they do not within a week.

        Parameters
        ----------
        zone
            The zone of the wall clock; None for that of this machine.
        """
        minute_s = now_s - now_s % 60
        for ahead in range(1, WEEK_MIN + 2 * 60):
            at_s = minute_s + 60 * ahead
            if self.include(datetime.fromtimestamp(at_s, zone)):
                return at_s
        return None


def parse_hours(text: str) -> Hours:
    """Return the hours of a text: parts `DAY-DAY HH:MM-HH:MM` with commas in between; without days, of every day.

    A span that ends before it begins goes on after midnight and belongs to the day on which it begins.

    Raises
    ------
    BadInput
        If the text has another form.

    Examples
    --------
    >>> parse_hours("Sat 22:00-02:00").spans
    ((8520, 240),)
    """
    return Hours(text, tuple(span for part in text.split(",") for span in _spans(part.strip(), text)))


def _spans(part: str, text: str) -> Iterator[tuple[int, int]]:
    found = _PART.fullmatch(part)
    if found is None:
        raise BadInput(f"expected {EXPECTED}, got {text!r}")
    begin, end = _minute(found["begin"], text), _minute(found["end"], text)
    if begin in (end, DAY_MIN):
        raise BadInput(f"expected {EXPECTED}, got {text!r}, of which {part!r} has no length")
    first = 0 if found["first"] is None else _day(found["first"], text)
    last = 6 if found["first"] is None else _day(found["last"] or found["first"], text)
    for day in range(first, (last if last >= first else last + 7) + 1):
        yield day % 7 * DAY_MIN + begin, (end - begin) % DAY_MIN or DAY_MIN


def _minute(clock: str, text: str) -> int:
    hour, minute = (int(number) for number in clock.split(":"))
    if minute > 59 or hour * 60 + minute > DAY_MIN:
        raise BadInput(f"expected {EXPECTED}, got {text!r}, in which {clock} is no time of a day")
    return hour * 60 + minute


def _day(name: str, text: str) -> int:
    if name.capitalize() not in DAYS:
        raise BadInput(f"expected {EXPECTED}, got {text!r}, in which {name} is none of {', '.join(DAYS)}")
    return DAYS.index(name.capitalize())
