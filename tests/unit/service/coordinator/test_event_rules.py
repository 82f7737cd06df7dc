"""The rules of events on plain values: neither a database nor a broker is there."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.job.messages.events import Event, EventKind, Failure
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import TaskStatus
from service.coordinator.event_rules import NO_ERROR, Batch, fold_events, without_old_heartbeats
from service.db.task_state import TaskState
from service.settings import Settings
from tests.builders_service import PROBE, T0, claimed, declined, done, event, failed, heartbeat

SETTINGS = Settings()
ORDER = Order(kind=TaskKind.RENDER, job_id="j", task_id="j-7", attempt="a", attempt_number=1, frame=3)
DISPATCHED = TaskState(
    job_id="j", sequence=7, kind=TaskKind.RENDER, stage="render/0003", frame=3, tile_row=0, tile_col=0, output=None,
    artifact="t", weight_px=90, status=TaskStatus.DISPATCHED, attempt="a", attempt_number=1, failures=0, failed_on=[],
    losses=0, deferrals=0, worker=None, instance=None, progress=None,
    error_code=None,
)  # fmt: skip


def fold(*events: Event, **state: Any) -> Batch:
    """Apply events to the one task that there is."""
    task = DISPATCHED._replace(**state)
    return fold_events({task.key: task}, events, now_s=T0, settings=SETTINGS)


def test_a_life_in_one_batch_is_one_change_with_all_its_columns() -> None:
    batch = fold(claimed(ORDER, "w7"), heartbeat(ORDER, 0.5, "w7"), done(ORDER, "w7", cpu_s=2.0, wall_s=4.0))
    (draft,) = batch.drafts.values()
    assert draft.values == {
        "status": TaskStatus.DONE, "worker": "w7", "instance": None, "claimed_s": T0, "heartbeat_s": T0,
        "progress": 1.0, "cpu_s": 2.0, "wall_s": 4.0, "ended_s": T0,
        **NO_ERROR, "digests": None, "cached": False,
    }  # fmt: skip
    assert draft.gains() == {
        "dispatched": -1, "done": 1, "cpu_s": 2.0, "wall_s": 4.0, "done_px": 90, "frames_done": 0,
        "artifact_bytes": 0,
    }  # fmt: skip


@pytest.mark.parametrize("say", [claimed, heartbeat, done, failed, declined])
@pytest.mark.parametrize("status", [status for status in TaskStatus if status not in ("dispatched", "running")])
def test_an_event_of_another_attempt_changes_nothing_and_is_late(say: Any, status: TaskStatus) -> None:
    batch = fold(say(ORDER), attempt="b", status=status)
    assert (batch.touched, batch.late) == (set(), {"j": 1})


@pytest.mark.promise("Between processes", "Only the worker that holds an attempt reports on it.")
@pytest.mark.parametrize("say", [claimed, heartbeat, done, failed, declined])
@pytest.mark.parametrize("holder", [("w2", None), ("w2", "i2"), ("w1", "i2")])
def test_an_event_of_a_worker_process_that_does_not_hold_the_attempt_changes_and_stops_nothing(
    say: Any, holder: tuple[str, str | None]
) -> None:
    message = say(ORDER).model_copy(update={"worker": "w1", "instance": "i1"})
    batch = fold(message, status=TaskStatus.RUNNING, worker=holder[0], instance=holder[1])
    assert (batch.touched, batch.late, batch.stops) == (set(), {"j": 1}, [])


@pytest.mark.parametrize("instance", [None, "f00d", "bb.f00d"])
def test_only_the_process_with_its_key_reports_on_the_attempt_of_a_worker_that_has_one(instance: str | None) -> None:
    message = done(ORDER).model_copy(update={"worker": "w1", "instance": instance})
    batch = fold(message, status=TaskStatus.RUNNING, worker="w1", instance="aa.f00d")
    assert (batch.touched, batch.late) == (set(), {"j": 1})
    assert fold(message, status=TaskStatus.RUNNING, worker="w1", instance=None).touched == {"j"}


def test_an_attempt_that_owns_nothing_is_requested_to_stop_only_while_it_works() -> None:
    told = [fold(say(ORDER), attempt="b").stops for say in (claimed, heartbeat, done, failed, declined)]
    assert told == [["a"], ["a"], [], [], []]


def test_what_follows_the_end_of_an_attempt_in_one_batch_is_a_repetition() -> None:
    batch = fold(claimed(ORDER), done(ORDER), heartbeat(ORDER), done(ORDER), claimed(ORDER))
    assert (batch.late, batch.stops) == ({}, [])


def test_a_failure_counts_against_the_worker_once() -> None:
    batch = fold(failed(ORDER, "w3"), failed(ORDER, "w3"))
    (draft,) = batch.drafts.values()
    assert [(fault.worker, fault.prevention) for fault in batch.faults] == [("w3", None)]
    assert (draft.now.status, draft.now.failures, draft.values["failed_on"]) == (TaskStatus.READY, 1, ["w3"])
    assert draft.gains() == {"dispatched": -1, "ready": 1}


def test_a_worker_without_its_sandbox_is_avoided_at_once_and_the_task_has_not_failed() -> None:
    failure = Failure(code="sandbox-missing", message="no", permanent=False)
    batch = fold(event(ORDER, EventKind.FAILED, "w3", failure=failure))
    assert [fault.prevention and fault.prevention.code for fault in batch.faults] == ["sandbox-missing"]
    assert next(iter(batch.drafts.values())).now.failures == 0


def test_the_measurements_of_a_probe_belong_to_its_job() -> None:
    order = ORDER.model_copy(update={"kind": TaskKind.PROBE})
    assert fold(done(order), kind=TaskKind.PROBE).probes == {"j": PROBE}
    assert fold(event(order, EventKind.DONE), kind=TaskKind.PROBE).probes == {}


def test_a_heartbeat_is_no_change_of_status() -> None:
    (draft,) = fold(heartbeat(ORDER, 0.25), status=TaskStatus.RUNNING).drafts.values()
    assert (draft.values, draft.gains()) == ({"heartbeat_s": T0, "progress": 0.25}, {})


def test_events_of_tasks_that_do_not_exist_count_for_no_job() -> None:
    strangers = [ORDER.model_copy(update={"task_id": text}) for text in ("nonsense", "j-8", "k-7")]
    batch = fold(*map(done, strangers), *map(claimed, strangers))
    assert (batch.touched, batch.late, batch.stops) == (set(), {}, ["a"] * 3)


def test_only_the_last_heartbeat_of_an_attempt_is_kept() -> None:
    other = ORDER.model_copy(update={"attempt": "b"})
    events = [heartbeat(ORDER, 0.1), heartbeat(other, 0.2), claimed(ORDER), heartbeat(ORDER, 0.3)]
    assert without_old_heartbeats(events) == events[1:]
