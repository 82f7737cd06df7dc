"""What a job will give, over HTTP."""

from __future__ import annotations

from collections import Counter
from typing import Any, cast
from xml.etree import ElementTree as ET

import pytest

from service.api import design
from service.auth import create_key
from service.schemas.access import Role
from tests.builders_service import SPEC, Client, Farm

DESIGN = "/api/v1/design"
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
