"""The previews that a process waits for: the newest of a series, and a few of a key."""

from __future__ import annotations

import pytest

from service.errors import TooManyRequests
from service.previews.series import PreviewSeries


def test_a_newer_preview_replaces_the_one_before_it_in_its_series_alone() -> None:
    series = PreviewSeries(by_key=9)
    first, other, stranger = series.open("k", "page"), series.open("k", "other"), series.open("k2", "page")
    second = series.open("k", "page")
    assert [one.is_replaced for one in (first, second, other, stranger)] == [True, False, False, False]
    series.close(first)  # which ends last and forgets nothing of its successor
    assert series.open("k", "page").is_replaced is False
    assert second.is_replaced


def test_a_preview_without_a_series_replaces_none() -> None:
    series = PreviewSeries(by_key=2)
    first, second = series.open("k", ""), series.open("k", "")
    assert not first.is_replaced
    assert not second.is_replaced


def test_a_key_waits_for_a_few_series_at_once() -> None:
    series = PreviewSeries(by_key=2)
    tickets = [series.open("k", name) for name in ("a", "b")]
    with pytest.raises(TooManyRequests, match="at most 2"):
        series.open("k", "c")
    series.open("k", "b")
    series.open("k2", "c")
    series.close(tickets[0])
    series.open("k", "c")
