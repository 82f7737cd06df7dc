"""A job file becomes a job, or an answer that says what is wrong with it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from lippmann.digest import Digest
from lippmann.errors import FieldProblem, OpticsError
from lippmann.job.resolved import ResolvedJob
from service.auth import Caller
from service.db.tables import Job, Task
from service.jobs import submission as submit
from service.ports import Parts
from tests.builders_service import CALLER, SPEC, Client, DictStore, Farm

JOBS = "/api/v1/jobs"


def test_a_job_file_becomes_a_queued_job_with_a_probe(api: Client, api_farm: Farm) -> None:
    answer = api.post(JOBS, json=SPEC)
    job = answer.json()
    assert answer.status_code == 201
    assert answer.headers["Location"] == f"{JOBS}/{job['id']}"
    assert (job["status"], job["tasks"]["ready"], job["frames"]) == ("queued", 1, {"count": 3, "text": "1-3"})
    assert job["size"] == {"rows": 80, "cols": 80, "lens_rows": 10, "lens_cols": 10, "px_per_lens": 8}
    assert (job["progress"], job["eta_s"], job["error"], job["owner"]) == (0.0, None, None, "tester")
    assert api.get(answer.headers["Location"]).json() == job
    assert [task.kind for task in api_farm.tasks(job["id"])] == ["probe"]


def test_the_sheet_is_stored_for_workers_with_the_scene_resolved(api: Client, api_farm: Farm) -> None:
    job_id = api.post(JOBS, json=SPEC).json()["id"]
    sheet = ResolvedJob.model_validate_json(api_farm.store.get_bytes(f"{job_id}/job.json"))
    assert sheet.job_id == job_id
    assert f"scenes/{sheet.bundle}.zip" in api_farm.store.files
    assert (sheet.stage.reference_mm, sheet.clock.per_frame) == (500, 1.0)


KNOWN_FIELDS = {
    "animation", "capture", "clock", "display", "fps", "frames", "outputs", "parameters", "priority", "render", "rig",
    "scene", "stage", "title",
}  # fmt: skip
"""The fields of a job that every release knows; a release refuses a job with one that it does not know."""


def test_services_and_workers_of_an_earlier_release_can_read_a_job_without_later_fields(farm: Farm) -> None:
    plain = farm.submit()
    chosen = farm.submit(slots=3, workers={"pool": "night"})
    assert farm.job(plain).spec.keys() == KNOWN_FIELDS
    assert farm.job(chosen).spec.keys() == KNOWN_FIELDS | {"slots", "workers"}
    assert (farm.job(chosen).parsed_spec.slots, farm.job(chosen).parsed_spec.workers.pool) == (3, "night")
    for job_id in (plain, chosen):
        assert json.loads(farm.store.get_bytes(f"{job_id}/job.json"))["spec"].keys() == KNOWN_FIELDS


def test_notes_on_the_optics_are_kept_with_the_job(api: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(submit, "check_job", lambda _sheet: ("the array stands close",))
    job_id = api.post(JOBS, json=SPEC).json()["id"]
    assert api.get(f"{JOBS}/{job_id}").json()["notes"] == ["the array stands close"]


@pytest.mark.filterwarnings("ignore:capture.method raytraced:FutureWarning")
def test_a_job_with_an_old_name_is_taken_and_keeps_a_note_of_the_new_one(api: Client) -> None:
    answer = api.post(JOBS, json={**SPEC, "capture": {"method": "raytraced"}})
    assert answer.status_code == 201
    job = api.get(answer.headers["Location"]).json()
    assert job["spec"]["capture"]["method"] == "glass"
    assert "capture.method raytraced is now glass; the next release refuses the old name" in job["notes"]
    designed = api.post("/api/v1/design", json={**SPEC, "capture": {"method": "raytraced"}}).json()
    assert designed["warnings"][0].startswith("capture.method raytraced is now glass")


@pytest.mark.parametrize(
    ("change", "field", "expected"),
    [
        ({"colour": 1}, "colour", "no field of this name"),
        ({"rig": {"lens_array": {"pich": 1}}}, "rig.lens_array.pich", "no field of this name (did you mean pitch_mm?)"),
        ({"frames": "4-1"}, "frames", "a range that counts up"),
        ({"scene": "nowhere"}, "scene", "the name of a scene on this farm"),
        ({"parameters": {"hue": 1}}, "parameters.hue", "no parameters"),
        ({"priority": 101}, "priority", "a number of at most 100"),
    ],
)
def test_what_cannot_be_is_named_by_field(api: Client, change: Any, field: str, expected: str) -> None:
    answer = api.post(JOBS, json=SPEC | change)
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"
    (error,) = answer.json()["errors"]
    assert (error["field"], error["expected"]) == (field, expected)
    assert error["got"]


def test_optics_that_cannot_be_built_are_a_problem_and_no_job(
    api: Client, api_farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> tuple[str, ...]:
        raise OpticsError.of([FieldProblem(field="rig.lens_array.pitch_mm", expected="less", got="99")])

    monkeypatch.setattr(submit, "check_job", refuse)
    answer = api.post(JOBS, json=SPEC)
    assert (answer.status_code, answer.json()["code"]) == (422, "optics")
    assert answer.json()["errors"][0]["field"] == "rig.lens_array.pitch_mm"
    assert api.get(JOBS).json()["items"] == []


def test_a_full_store_is_said_and_leaves_nothing(api: Client, api_farm: Farm) -> None:
    before = dict(api_farm.store.files)
    api_farm.store.full = True
    answer = api.post(JOBS, json=SPEC)
    assert (answer.status_code, answer.json()["code"]) == (507, "store-full")
    assert (api.get(JOBS).json()["items"], api_farm.store.files) == ([], before)


def test_a_crash_between_artifact_and_row_leaves_no_job(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    def crash(*_: Any) -> None:
        raise RuntimeError

    monkeypatch.setattr(submit, "insert_tasks", crash)
    with pytest.raises(RuntimeError):
        farm.submit()
    with farm.database.reading() as session:
        assert (session.query(Job).count(), session.query(Task).count()) == (0, 0)


def test_the_same_key_and_job_file_is_the_same_job(api: Client) -> None:
    headers = {"Idempotency-Key": "one"}
    first = api.post(JOBS, json=SPEC, headers=headers)
    again = api.post(JOBS, json=SPEC, headers=headers)
    assert (first.status_code, again.status_code) == (201, 200)
    assert again.json()["id"] == first.json()["id"]
    assert len(api.get(JOBS).json()["items"]) == 1


def test_the_same_key_for_another_job_file_is_refused(api: Client) -> None:
    headers = {"Idempotency-Key": "one"}
    api.post(JOBS, json=SPEC, headers=headers)
    answer = api.post(JOBS, json=SPEC | {"frames": "9"}, headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (422, "idempotency-mismatch")


def test_the_same_key_used_twice_at_once_makes_one_job(farm: Farm) -> None:
    """The second submission comes while the first one stores its sheet, after it found no job of this key."""
    others: list[str] = []

    class Racing(DictStore):
        def put_bytes(self, name: str, data: bytes) -> Digest:
            digest = super().put_bytes(name, data)
            if not others:
                others.append("submitting")
                others.append(_submitted(farm, farm.parts))
            return digest

    first = _submitted(farm, replace(farm.parts, store=Racing(files=farm.store.files)))
    assert others[1:] == [first]
    with farm.database.reading() as session:
        assert session.query(Job).count() == 1


def _submitted(farm: Farm, parts: Parts) -> str:
    job, _ = submit.submit_job(
        farm.database, parts, CALLER, SPEC, idempotency_key="one", now_s=farm.now_s, settings=farm.settings
    )
    return job.id


def test_two_callers_may_use_the_same_key(farm: Farm) -> None:
    ids = []
    for key_id in ("a", "b"):
        caller = Caller(id=key_id, key_id=key_id, name="n", role=CALLER.role, owner_id=key_id)
        job, _ = submit.submit_job(
            farm.database, farm.parts, caller, SPEC, idempotency_key="one", now_s=farm.now_s, settings=farm.settings
        )
        ids.append(job.id)
    assert ids[0] != ids[1]


@pytest.mark.parametrize("body", [b"{", b"[]", b"7", b"null", json.dumps("x").encode()])
def test_what_is_no_job_file_is_a_problem(api: Client, body: bytes) -> None:
    answer = api.post(JOBS, content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_jobs_are_listed_newest_first_in_pages(api: Client, api_farm: Farm) -> None:
    made = []
    for _ in range(5):
        api_farm.now_s += 1
        made.append(api.post(JOBS, json=SPEC).json()["id"])
    seen: list[str] = []
    cursor = ""
    while True:
        page = api.get(JOBS, params={"limit": 2} | ({"cursor": cursor} if cursor else {})).json()
        seen += [job["id"] for job in page["items"]]
        cursor = page["next_cursor"]
        if cursor is None:
            break
    assert seen == made[::-1]


def test_priority_is_changed_by_patch(api: Client) -> None:
    job_id = api.post(JOBS, json=SPEC).json()["id"]
    assert api.patch(f"{JOBS}/{job_id}", json={"priority": 7}).json()["priority"] == 7
    assert api.patch(f"{JOBS}/{job_id}", json={"priority": 700}).status_code == 422
    wrong = api.patch(f"{JOBS}/{job_id}", json={"prio": 7}).json()["errors"]
    assert [error["field"] for error in wrong] == ["prio"]
    assert api.patch(f"{JOBS}/{job_id}", json={}).status_code == 422


def test_progress_is_by_pixels_and_the_rest_of_the_time_by_what_was_measured(api: Client, api_farm: Farm) -> None:
    from tests.builders_service import claimed, done, heartbeat

    job_id = api_farm.planned(outputs=[])
    first, second, *_ = api_farm.dispatch()
    assert api.get(f"{JOBS}/{job_id}").json()["eta_s"] is None
    api_farm.say(claimed(first), done(first, wall_s=10.0), claimed(second), heartbeat(second, 0.5))
    job = api.get(f"{JOBS}/{job_id}").json()
    tile_px, total_px = 40 * 80, 3 * (80 * 80 + 80 * 80 // 20)
    assert job["progress"] == pytest.approx(1.5 * tile_px / total_px)
    # wall_s counts the probe's 4 s too: it is part of what the job has taken so far.
    assert job["eta_s"] == pytest.approx((total_px - 1.5 * tile_px) * 14.0 / tile_px)
