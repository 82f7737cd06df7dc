"""Progress and time left of a job, from its row."""

from __future__ import annotations

import pytest

from lippmann.job.states import JobStatus
from service.db.tables import Job
from service.events.payloads import eta_s, progress


def _row(**columns: object) -> Job:
    known = {
        "status": JobStatus.RUNNING,
        "planned_s": 1.0,
        "total_px": 1000,
        "done_px": 200,
        "wall_s": 40.0,
        "running": 1,
        "cached_px": 0,
    }
    return Job(**known | columns)


def test_the_time_left_is_the_remaining_pixels_at_the_measured_speed() -> None:
    # 40 s for 200 px; 800 px are left, of which running attempts have finished 300.
    assert eta_s(_row(), 0.0) == pytest.approx(160.0)
    assert eta_s(_row(), 300.0) == pytest.approx(100.0)


def test_pixels_from_the_cache_measure_nothing() -> None:
    # 40 s for 100 rendered px.
    assert eta_s(_row(cached_px=100), 0.0) == pytest.approx(320.0)
    assert eta_s(_row(cached_px=200), 0.0) is None


@pytest.mark.parametrize("running", [2, 4, 16])
def test_the_time_left_is_divided_by_the_running_tasks(running: int) -> None:
    assert eta_s(_row(running=running), 0.0) == pytest.approx(160.0 / running)


@pytest.mark.parametrize(
    "columns", [{"running": 0}, {"done_px": 0}, {"wall_s": 0.0}, {"planned_s": None}, {"status": JobStatus.PAUSED}]
)
def test_there_is_no_time_left_while_nothing_runs_or_nothing_was_measured(columns: dict[str, object]) -> None:
    assert eta_s(_row(**columns), 0.0) is None


def test_progress_counts_finished_pixels_and_never_more_than_all() -> None:
    assert progress(_row(), 300.0) == pytest.approx(0.5)
    assert progress(_row(), 10_000.0) == 1.0
    assert progress(_row(status=JobStatus.DONE, done_px=0), 0.0) == 1.0
