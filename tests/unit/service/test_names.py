"""Names of jobs and tasks."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import NotFound
from service.ids import new_job_id, parse_task_id, task_id


@given(st.floats(0, 3e10), st.integers(0, 999_999))
def test_parsing_a_task_id_is_the_inverse_of_making_one(now_s: float, sequence: int) -> None:
    job_id = new_job_id(now_s)
    assert parse_task_id(task_id(job_id, sequence)) == (job_id, sequence)


@given(st.floats(0, 3e10), st.floats(0.002, 1e6))
def test_job_ids_sort_by_time(now_s: float, later_s: float) -> None:
    assert new_job_id(now_s) < new_job_id(now_s + later_s)


@pytest.mark.parametrize("text", ["", "x", "-", "-1", "a-", "a-x", "a--", "a-1x", "a-" + "9" * 40, "a-²"])
def test_what_is_no_task_id_is_not_found(text: str) -> None:
    with pytest.raises(NotFound):
        parse_task_id(text)
