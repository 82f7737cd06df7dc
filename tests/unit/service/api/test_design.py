"""What a job will give, over HTTP."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, cast
from xml.etree import ElementTree as ET

import pytest

from service.api import design
from service.auth import create_key
from service.main import create_app
from service.schemas.access import KeyLimits, Role
from tests.builders_service import SPEC, Client, Farm

DESIGN = "/api/v1/design"
OFFSET = "rig.lens_array.offset_mm"
FAR = SPEC | {"rig": {"lens_array": {"offset_mm": 5000}}}
SVG = {"Accept": "image/svg+xml"}


def test_a_job_file_has_a_design_and_nothing_is_kept(api: Client, api_farm: Farm) -> None:
    before = dict(api_farm.store.files)
    answer = api.post(DESIGN, json=SPEC)
    assert answer.status_code == 200
    found = answer.json()
    assert (found["efl_mm"], found["px_per_lens"]) == (pytest.approx(300.46784621322), 8)
    assert found["conjugates"]["reference"]["object_mm"] == 500.0
    assert (found["scene"], found["frame"]) == ("ball", 1)
    assert api.get("/api/v1/jobs").json()["items"] == []
    assert api_farm.store.files == before


def test_who_accepts_a_picture_is_given_the_drawing(api: Client) -> None:
    answer = api.post(DESIGN, json=SPEC | {"title": "<&>"}, headers=SVG)
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].startswith("image/svg+xml")
    assert ET.fromstring(answer.text)[0].text == "<&>"


def test_a_submitted_job_can_be_designed_as_it_is_shown(api: Client) -> None:
    job = api.post("/api/v1/jobs", json=SPEC).json()
    assert api.post(DESIGN, json=job["spec"]).json() == api.post(DESIGN, json=SPEC).json() | {"title": ""}


def test_an_animated_job_is_designed_at_a_frame(api: Client) -> None:
    sweep = {"keyframes": [[1, 60.0], [3, -10.0]]}
    job = SPEC | {"rig": {"lens_array": {"count": [10, 10], "offset_mm": sweep}}}
    found = [api.post(DESIGN, json=job, params=at).json()["s_reference_mm"] for at in ({}, {"frame": 3})]
    assert found == pytest.approx([60.0, -10.0])


@pytest.mark.parametrize("headers", [{}, SVG], ids=["numbers", "drawing"])
@pytest.mark.parametrize(
    ("change", "field", "code"),
    [
        ({"colour": 1}, "colour", "spec"),
        ({"scene": "nowhere"}, "scene", "spec"),
        ({"rig": {"lens_array": {"pitch_mm": 3.0}}}, "rig.lens_array.pitch_mm", "optics"),
        ({"rig": {"lens_array": {"offset_mm": 5000}}}, "rig.lens_array.offset_mm", "optics"),
    ],
)
def test_what_cannot_be_is_named_as_when_it_is_submitted(
    api: Client, headers: dict[str, str], change: Any, field: str, code: str
) -> None:
    answer = api.post(DESIGN, json=SPEC | change, headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (422, code)
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.json()["errors"] == api.post("/api/v1/jobs", json=SPEC | change).json()["errors"]
    assert answer.json()["errors"][0]["field"] == field


def test_a_frame_between_keys_where_a_number_is_out_of_bounds_is_named(api: Client) -> None:
    """Dispersion is off or on, and at frame 2 half-way."""
    job = SPEC | {"rig": {"dispersion": {"keyframes": [[1, 1], [3, 0]]}}}
    for headers in ({}, SVG):
        answer = api.post(DESIGN, json=job, params={"frame": 2}, headers=headers)
        assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "rig.dispersion")


@pytest.mark.parametrize(("name", "headers"), [("design", {}), ("drawing", SVG)])
def test_no_connection_is_held_while_a_design_is_computed(
    api: Client, api_farm: Farm, monkeypatch: pytest.MonkeyPatch, name: str, headers: dict[str, str]
) -> None:
    computed, lent = getattr(design, name), Counter[str]()

    def computes(*given: Any, **more: Any) -> Any:
        lent["while computing"] += house_pool(api).checkedout()
        return computed(*given, **more)

    monkeypatch.setattr(design, name, computes)
    assert api.post(DESIGN, json=SPEC, headers=headers).status_code == 200
    assert lent == {"while computing": 0}


def house_pool(api: Client) -> Any:
    return cast(Any, api.app).state.lippmann.database._engine.pool


@pytest.mark.parametrize("body", [b"{", b"[]", b"null"])
def test_what_is_no_job_file_is_a_problem(api: Client, body: bytes) -> None:
    answer = api.post(DESIGN, content=body, headers={"Content-Type": "application/json"})
    assert (answer.status_code, answer.headers["Content-Type"]) == (422, "application/problem+json")


def test_a_viewer_may_ask_and_a_stranger_may_not(api: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        viewer = create_key(session, "viewer", Role.VIEWER)[1]
    assert api.post(DESIGN, json=SPEC, headers={"Authorization": f"Bearer {viewer}"}).status_code == 200
    api.headers.pop("Authorization")
    assert api.post(DESIGN, json=SPEC).status_code == 401


def test_a_check_answers_every_job_file_with_the_fields_at_fault_or_with_the_design(api: Client) -> None:
    found = api.post(f"{DESIGN}/check", json=SPEC).json()
    assert (found["detail"], found["errors"]) == ("", [])
    assert found["design"] == api.post(DESIGN, json=SPEC).json()
    for body, field in (
        ([], None),
        (SPEC | {"colour": 1}, "colour"),
        (SPEC | {"scene": "nowhere"}, "scene"),
        (FAR, OFFSET),
    ):
        answer = api.post(f"{DESIGN}/check", json=body)
        refused = api.post(DESIGN, json=body).json()
        assert answer.status_code == 200
        assert (answer.json()["detail"], answer.json()["errors"]) == (refused["detail"], refused["errors"])
        assert [error["field"] for error in refused["errors"]] == ([field] if field else [])
        assert answer.json()["design"] is None


def test_a_check_says_what_the_job_would_use_of_each_limit_as_a_submission_does(make_farm: Callable[..., Farm]) -> None:
    farm = make_farm(coordinator=False, max_frames=4, max_open_jobs=1)
    with Client(create_app(farm.settings, farm.parts)) as client:
        with farm.writing() as session:
            _, key = create_key(session, "small", Role.SUBMITTER, limits=KeyLimits(frames=3), now_s=farm.now_s)
        client.headers["Authorization"] = f"Bearer {key}"
        found = client.post(f"{DESIGN}/check", json=SPEC | {"frames": "1-3"}).json()
        limits = {limit["name"]: limit for limit in found["limits"]}
        assert not any(limit["exceeded"] for limit in limits.values())
        assert limits["frames"] == {
            "name": "frames", "used": 3, "limit": 3, "source": "the limit frames of the key", "exceeded": False,
        }  # fmt: skip
        assert limits["open_jobs"]["used"] == 1
        longer = SPEC | {"frames": "1-4"}
        found = client.post(f"{DESIGN}/check", json=longer).json()
        assert found["errors"] == client.post("/api/v1/jobs", json=longer).json()["errors"]
        assert [limit["name"] for limit in found["limits"] if limit["exceeded"]] == ["frames"]
        assert found["design"] is not None
        assert client.post("/api/v1/jobs", json=SPEC).status_code == 201
        found = client.post(f"{DESIGN}/check", json=SPEC).json()
        assert [limit["name"] for limit in found["limits"] if limit["exceeded"]] == ["open_jobs"]
        assert client.post("/api/v1/jobs", json=SPEC).status_code == 429
