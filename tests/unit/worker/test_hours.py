"""The hours of a worker are those of the clock on its wall, also in the nights in which it is set."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import pytest

from lippmann.errors import BadInput
from worker.hours import DAY_MIN, parse_hours

ATHENS = ZoneInfo("Europe/Athens")
"""Clocks go from 03:00 to 04:00 on 29 March 2026, and from 04:00 back to 03:00 on 25 October 2026."""
NIGHTS = "Mon-Fri 19:00-07:00, Sat-Sun 00:00-24:00"


def at(text: str) -> datetime:
    return datetime.fromisoformat(text)


@pytest.mark.parametrize(
    ("text", "is_open"),
    [
        ("2026-11-30T18:59", False),  # a Monday
        ("2026-11-30T19:00", True),
        ("2026-12-01T06:59", True),
        ("2026-12-01T07:00", False),
        ("2026-12-04T23:00", True),
        ("2026-12-05T07:00", True),  # a Saturday, all day
        ("2026-12-06T23:59", True),
        ("2026-12-07T00:00", False),  # the night of Sunday is no night of Monday to Friday
    ],
)
def test_a_span_past_midnight_belongs_to_the_day_on_which_it_begins(text: str, *, is_open: bool) -> None:
    assert parse_hours(NIGHTS).include(at(text)) is is_open


def test_a_week_that_begins_on_friday_and_one_without_days() -> None:
    weekend = parse_hours("fri-mon 12:00-13:00")
    open_days = [day for day in range(7) if weekend.include(datetime(2026, 11, 30 - 7 + day, 12, 30))]
    assert open_days == [0, 4, 5, 6]
    always = parse_hours("00:00-24:00")
    assert all(always.include(datetime(2026, 11, 24 + day, hour)) for day in range(6) for hour in range(24))
    assert sum(length for _, length in always.spans) == 7 * DAY_MIN


def opening(hours: str, now: datetime) -> datetime | None:
    found = parse_hours(hours).next_begin_s(now.timestamp(), ATHENS)
    return None if found is None else datetime.fromtimestamp(found, ATHENS)


def test_hours_that_do_not_exist_are_skipped_when_clocks_are_set_forward() -> None:
    night = datetime(2026, 3, 29, 2, 30, tzinfo=ATHENS)
    found = opening("Sun 03:30-05:00", night)
    assert found == datetime(2026, 3, 29, 4, 0, tzinfo=ATHENS), "03:30 does not exist, and the next minute is 04:00"
    assert found is not None
    assert found.timestamp() - night.timestamp() == 30 * 60


def test_hours_that_come_twice_are_open_twice_when_clocks_are_set_back() -> None:
    hours = parse_hours("Sun 03:15-03:45")
    times = [datetime.fromtimestamp(s, ATHENS) for s in range(1_792_882_800, 1_792_882_800 + 5 * 3600, 900)]
    assert [time.astimezone(UTC).strftime("%H:%M") for time in times if hours.include(time)] == [
        "00:15", "00:30", "01:15", "01:30",
    ]  # fmt: skip


def test_the_next_opening_may_be_days_away() -> None:
    assert opening("Mon 08:00-09:00", datetime(2026, 11, 30, 9, 0, tzinfo=ATHENS)) == at("2026-12-07T08:00+02:00")


@pytest.mark.parametrize(
    "text", ["", "19-7", "Mon 19:00", "Mon-Fri 25:00-07:00", "Mon 12:61-13:00", "Noday 10:00-11:00", "10:00-10:00",
             "24:00-10:00", "Mon 10:00-11:00;Tue 10:00-11:00", "Mon 10:00-11:00,"],
)  # fmt: skip
def test_other_texts_are_refused_with_an_example(text: str) -> None:
    with pytest.raises(BadInput, match="expected hours such as `Mon-Fri 19:00-07:00"):
        parse_hours(text)
