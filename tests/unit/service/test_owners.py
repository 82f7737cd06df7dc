"""Jobs and scenes have owners."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from lippmann.plan import artifact_names as names
from service.api.presenters import present_job
from service.auth import create_key
from service.db import coordinator as coordinator_rows
from service.jobs.state_machine import find_job
from service.schemas.access import Role
from service.schemas.wait import WaitCode
from tests.builders_service import SPEC, Client, Farm, presence

API = "/api/v1"
Headers = dict[str, str]


def _key(farm: Farm, owner_id: str | None, role: Role = Role.SUBMITTER) -> Headers:
    with farm.writing() as session:
        return {"Authorization": f"Bearer {create_key(session, 'a key', role, owner_id=owner_id)[1]}"}


def _submit(client: Client, headers: Headers, **changes: Any) -> str:
    answer = client.post(f"{API}/jobs", json=SPEC | changes, headers=headers)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def _upload(client: Client, headers: Headers, data: bytes = b"PK one", name: str = "mine") -> int:
    files = {"bundle": ("b.zip", data, "application/zip")}
    answer = client.post(f"{API}/scenes", params={"name": name}, files=files, headers=headers)
    return int(answer.status_code)


@pytest.fixture
def closed(make_farm: Callable[..., Farm]) -> Farm:
    """Return a farm on which nobody sees the jobs and scenes of others."""
    return make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", sharing=False)


def test_keys_of_one_owner_change_each_others_jobs_and_a_key_without_one_is_its_own(
    api: Client, api_farm: Farm
) -> None:
    laptop, cluster, alone = (_key(api_farm, owner) for owner in ("ann", "ann", None))
    job_id = _submit(api, laptop)
    session = api.get(f"{API}/session", headers=cluster).json()
    assert api.get(f"{API}/jobs/{job_id}", headers=alone).json()["owner_id"] == session["owner_id"] == "ann"
    refused = api.post(f"{API}/jobs/{job_id}/cancel", headers=alone)
    assert (refused.status_code, refused.json()["detail"]) == (
        403, "the job belongs to 'ann', and only its owner and admins change it",
    )  # fmt: skip
    assert api.post(f"{API}/jobs/{job_id}/cancel", headers=cluster).status_code == 200
    assert api.post(f"{API}/jobs/{_submit(api, alone)}/cancel", headers=alone).status_code == 200


def test_a_scene_is_replaced_by_its_owner_and_admins_only(api: Client, api_farm: Farm) -> None:
    ann, bob = _key(api_farm, "ann"), _key(api_farm, "bob")
    assert _upload(api, ann) == 201
    assert _upload(api, bob) == 200  # the same bundle changes nothing
    assert _upload(api, bob, b"PK two") == 403
    assert _upload(api, ann, b"PK two") == 201
    assert _upload(api, dict(api.headers), b"PK three") == 201
    scene = api.get(f"{API}/scenes/mine").json()
    assert (scene["owner_id"], scene["owner"]) == ("ann", "a key")


def test_without_sharing_others_see_neither_jobs_nor_scenes(
    closed: Farm, make_client: Callable[[Farm], Client]
) -> None:
    api = make_client(closed)
    ann, bob, admin = _key(closed, "ann"), _key(closed, "bob"), dict(api.headers)
    assert _upload(api, ann) == 201
    job_id = _submit(api, ann, scene="mine")

    def seen(headers: Headers) -> tuple[list[str], list[str]]:
        jobs = api.get(f"{API}/jobs", headers=headers).json()["items"]
        scenes = api.get(f"{API}/scenes", headers=headers).json()["items"]
        return [job["id"] for job in jobs], [scene["name"] for scene in scenes]

    assert seen(ann) == seen(admin) == ([job_id], ["ball", "mine"])
    assert seen(bob) == ([], ["ball"])
    for path in ("scenes/mine", "scenes/mine/poster.png", f"events?job={job_id}"):
        assert api.get(f"{API}/{path}", headers=bob).status_code == 404, path
    for path in ("jobs", "design"):
        refused = api.post(f"{API}/{path}", json=SPEC | {"scene": "mine"}, headers=bob)
        assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "scene")
    assert _upload(api, bob) == 403  # the answer must not tell whose bundle it is


@pytest.mark.parametrize("sharing", [True, False])
def test_a_job_that_waits_names_the_jobs_before_it_only_to_those_who_may_see_them(
    make_farm: Callable[..., Farm], *, sharing: bool
) -> None:
    farm = make_farm(sharing=sharing)
    farm.workers = [presence(slots=1)]
    first, second, waiting = farm.submit(priority=90), farm.submit(priority=80), farm.submit()
    with farm.writing() as session:
        coordinator_rows.acquire_leadership(session, "this", now_s=farm.now_s, until_s=farm.now_s + 10)
    with farm.database.reading() as session:
        wait = present_job(session, find_job(session, waiting), farm.outlook()).wait
    assert wait is not None
    assert wait.code is WaitCode.HIGHER_PRIORITY
    assert wait.jobs == ((first, second) if sharing else ())
    assert first not in wait.message


@pytest.mark.parametrize(("sharing", "scope"), [(True, None), (False, "ann")])
def test_the_render_cache_is_of_one_owner_where_jobs_are_hidden(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], *, sharing: bool, scope: str | None
) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", sharing=sharing)
    job_id = _submit(make_client(farm), _key(farm, "ann"))
    assert json.loads(farm.store.files[names.job_artifact(job_id, names.JOB_FILE)]).get("cache_scope") == scope


@pytest.mark.promise(
    "People", "Where jobs are hidden, others see a job only while its owner shares it, and do not change it."
)
def test_a_shared_job_is_seen_by_others_and_changed_by_its_owner(
    closed: Farm, make_client: Callable[[Farm], Client]
) -> None:
    api = make_client(closed)
    ann, bob = _key(closed, "ann"), _key(closed, "bob")
    job_id, other = _submit(api, ann), _submit(api, ann)
    paths = [f"jobs/{job_id}", f"jobs/{job_id}/tasks", f"jobs/{job_id}/artifacts/job.json"]

    def change(headers: Headers, **changes: Any) -> int:
        return int(api.patch(f"{API}/jobs/{job_id}", json=changes, headers=headers).status_code)

    def seen() -> list[int]:
        return [api.get(f"{API}/{path}", headers=bob).status_code for path in paths]

    assert change(bob, shared=True) == 404
    assert seen() == [404] * 3
    assert change(ann, shared=True) == 200
    assert seen() == [200] * 3
    assert api.get(f"{API}/jobs/{other}", headers=bob).status_code == 404
    (listed,) = api.get(f"{API}/jobs", headers=bob).json()["items"]
    assert (listed["id"], listed["shared"]) == (job_id, True)
    assert change(bob, shared=False) == 403
    assert api.post(f"{API}/jobs/{job_id}/cancel", headers=bob).status_code == 403
    assert change(ann, shared=False, priority=70) == 200
    assert seen() == [404] * 3
    entries = api.get(f"{API}/audit").json()["items"]
    assert [(entry["action"], entry["detail"]) for entry in entries if entry["subject"] == job_id][:3] == [
        ("share-job", "seen by its owner"), ("prioritise-job", "priority 70"), ("share-job", "seen by all"),
    ]  # fmt: skip
    assert change(ann) == 422
