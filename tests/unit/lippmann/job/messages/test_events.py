"""What workers say is believed only within bounds, since plans are made of it."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from lippmann.job.messages.events import LONGEST_PROBE_S, MAX_MESSAGE, Event, Failure, Presence, ProbeResult
from lippmann.job.spec import JobSpec
from lippmann.plan.tasks import plan_sheet

BAD = (-1.0, float("nan"), float("inf"), 2 * LONGEST_PROBE_S, 8.5e303)


@pytest.mark.parametrize("field", ["start_s", "s_per_px"])
@pytest.mark.parametrize("seconds", BAD)
def test_a_probe_that_measured_what_cannot_be_is_refused(field: str, seconds: float) -> None:
    with pytest.raises(ValidationError):
        ProbeResult.model_validate({"start_s": 0.5, "s_per_px": 1e-5, "tileable": True, field: seconds})


@pytest.mark.parametrize("field", ["cpu_s", "wall_s", "at_s"])
def test_an_event_with_a_time_that_is_no_number_is_refused(field: str) -> None:
    said = {"kind": "done", "job_id": "j", "task_id": "j-1", "attempt": "a", "worker": "w", "at_s": 1.0}
    Event.model_validate(said)
    with pytest.raises(ValidationError):
        Event.model_validate(said | {field: float("nan")})


@pytest.mark.parametrize("seconds", [0.0, LONGEST_PROBE_S])
def test_the_largest_job_can_be_planned_from_the_slowest_and_the_quickest_probe(seconds: float) -> None:
    rig = {"lens_array": {"count": [500, 500]}, "px_per_lens": 16}
    spec = JobSpec.model_validate({"scene": "ball", "frames": "1-1000", "rig": rig})
    sheet = plan_sheet(spec, ProbeResult(start_s=seconds, s_per_px=seconds, tileable=True), slots=2000)
    assert 1 <= sheet.tile_rows <= 100


SAID = {"kind": "done", "job_id": "j", "task_id": "j-1", "attempt": "a", "worker": "w", "at_s": 1.0}
FAILURE = {"code": "scene", "message": "a fault", "permanent": True}
DIGEST = [7, "0" * 64]


@pytest.mark.parametrize(
    "change",
    [
        {"job_id": "j" * 501},
        {"worker": "a\0b"},
        {"worker": "a\udc00b"},
        {"attempt": "a\udc00b"},
        {"digests": {"a\udc00b": DIGEST}},
        {"cpu_s": -1.0},
        {"wall_s": 1e300},
        {"failure": FAILURE | {"frame": 2**63}},
        {"failure": FAILURE | {"artifact": "a\0b"}},
        {"digests": {"a\0b": DIGEST}},
        {"digests": {"a": [2**63, "0" * 64]}},
        {"digests": {"a": [7, "0" * 63 + "\0"]}},
    ],
)
def test_an_event_that_a_database_does_not_take_is_refused(change: dict[str, Any]) -> None:
    """One such event would be read again and again, and no event after it would be."""
    assert Event.model_validate(SAID | {"failure": FAILURE, "digests": {"a": DIGEST}})
    with pytest.raises(ValidationError):
        Event.model_validate(SAID | change)


def test_a_message_is_cut_and_has_no_nul() -> None:
    """What a scene prints gets into messages, so they are mended and not refused."""
    failure = Failure.model_validate(FAILURE | {"message": "a\0b\udc00" + "c" * MAX_MESSAGE})
    assert failure.message == "a\N{REPLACEMENT CHARACTER}b\N{REPLACEMENT CHARACTER}" + "c" * (MAX_MESSAGE - 4)


@pytest.mark.parametrize("change", [{"slots": 10**9}, {"slots": -1}, {"seen_s": float("inf")}, {"host": "h" * 501}])
def test_a_presence_that_cannot_be_is_refused(change: dict[str, Any]) -> None:
    said = {"name": "w", "host": "h", "pid": 1, "slots": 2, "sandbox": "bwrap", "povray": "3.7", "version": "0"}
    times = {"started_s": 1.0, "seen_s": 1.0}
    Presence.model_validate(said | times)
    with pytest.raises(ValidationError):
        Presence.model_validate(said | times | change)
