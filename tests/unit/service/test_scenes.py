"""Scenes that come along, and scenes of users."""

from __future__ import annotations

from service.scenes import sync_builtin
from tests.builders_service import SPEC, T0, Client, Farm

SCENES = "/api/v1/scenes"


def _upload(api: Client, name: str, data: bytes = b"PK mine"):  # type: ignore[no-untyped-def]
    return api.post(SCENES, params={"name": name}, files={"bundle": ("scene.zip", data)})


def test_scenes_that_come_along_are_there_from_the_start(api: Client, api_farm: Farm) -> None:
    (scene,) = api.get(SCENES).json()["items"]
    assert (scene["name"], scene["title"], scene["builtin"]) == ("ball", "A ball", True)
    assert f"scenes/{scene['digest']}.zip" in api_farm.store.files
    assert api.get(f"{SCENES}/ball").json() == scene
    poster = api.get(scene["poster"])
    assert (poster.content, poster.headers["Content-Type"]) == (b"poster", "image/png")


def test_starting_again_changes_nothing_and_brings_back_a_lost_bundle(farm: Farm) -> None:
    before = dict(farm.store.files)
    farm.store.files.clear()
    sync_builtin(farm.database, farm.parts, now_s=T0)
    assert farm.store.files == before


def test_a_user_scene_is_stored_and_can_be_asked_for(api: Client, api_farm: Farm) -> None:
    answer = _upload(api, "mine")
    assert (answer.status_code, answer.headers["Location"]) == (201, f"{SCENES}/mine")
    assert f"scenes/{answer.json()['digest']}.zip" in api_farm.store.files
    assert [scene["name"] for scene in api.get(SCENES).json()["items"]] == ["ball", "mine"]
    assert api.post("/api/v1/jobs", json=SPEC | {"scene": "mine"}).status_code == 201


def test_the_same_bundle_again_is_no_new_scene(api: Client) -> None:
    _upload(api, "mine")
    assert _upload(api, "mine").status_code == 200


def test_the_answer_to_an_upload_has_the_notes_on_the_bundle(api: Client) -> None:
    assert _upload(api, "mine").json()["notes"] == ["a note"]
    assert _upload(api, "mine").json()["notes"] == ["a note"]
    assert api.get(f"{SCENES}/mine").json()["notes"] == []


def test_another_bundle_under_a_users_name_replaces_it_and_old_jobs_keep_theirs(api: Client, api_farm: Farm) -> None:
    old = _upload(api, "mine").json()["digest"]
    job_id = api.post("/api/v1/jobs", json=SPEC | {"scene": "mine"}).json()["id"]
    new = _upload(api, "mine", b"PK other").json()["digest"]
    assert old != new
    assert f"scenes/{old}.zip" in api_farm.store.files
    assert old in api_farm.store.get_bytes(f"{job_id}/job.json").decode()


def test_a_broken_bundle_is_refused_with_its_reason(api: Client) -> None:
    answer = _upload(api, "mine", b"nonsense")
    assert (answer.status_code, answer.json()["code"]) == (422, "bundle")
    assert "scene.toml" in answer.json()["detail"]


def test_the_name_of_a_scene_that_comes_along_is_taken(api: Client) -> None:
    assert (_upload(api, "ball").status_code, _upload(api, "ball").json()["code"]) == (409, "scene-builtin")


def test_a_name_that_cannot_be_one_is_refused(api: Client) -> None:
    answer = _upload(api, "../x")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "name")


def test_a_full_store_takes_no_scene(api: Client, api_farm: Farm) -> None:
    api_farm.store.full = True
    assert _upload(api, "mine").status_code == 507
    assert api.get(f"{SCENES}/mine").status_code == 404


def test_an_upload_without_a_bundle_is_refused(api: Client) -> None:
    answer = api.post(SCENES, params={"name": "mine"}, files={"other": ("scene.zip", b"PK")})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "bundle")
    answer = api.post(SCENES, params={"name": "mine"}, data={"bundle": "text"})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "bundle")


def test_a_scene_is_removed_by_its_owner_and_its_jobs_keep_it(api: Client, api_farm: Farm) -> None:
    digest = _upload(api, "mine").json()["digest"]
    job_id = api.post("/api/v1/jobs", json=SPEC | {"scene": "mine"}).json()["id"]
    assert api.delete(f"{SCENES}/mine").status_code == 204
    assert [scene["name"] for scene in api.get(SCENES).json()["items"]] == ["ball"]
    assert api.get(f"/api/v1/jobs/{job_id}").json()["scene"] == "mine"
    assert f"scenes/{digest}.zip" in api_farm.store.files
    assert api.delete(f"{SCENES}/mine").json()["code"] == "not-found"


def test_a_built_in_scene_is_not_removed(api: Client) -> None:
    answer = api.delete(f"{SCENES}/ball")
    assert (answer.status_code, answer.json()["code"]) == (409, "scene-builtin")
    assert api.get(f"{SCENES}/ball").status_code == 200


def test_an_unknown_scene_is_answered_with_the_one_that_is_meant(api: Client) -> None:
    _upload(api, "my-orchard")
    assert api.get(f"{SCENES}/my-orchad").json()["detail"] == "there is no scene 'my-orchad' (did you mean my-orchard?)"
    (error,) = api.post("/api/v1/jobs", json=SPEC | {"scene": "bal"}).json()["errors"]
    assert error["expected"] == "the name of a scene on this farm (did you mean ball?)"
    assert api.get(f"{SCENES}/zzz").json()["detail"] == "there is no scene 'zzz'"
