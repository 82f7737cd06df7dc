"""The JSON schemas from which forms are drawn, over HTTP."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from lippmann.job.animation.keyframes import ANIMATED_PARTS
from lippmann.job.presets import LENS_ARRAYS, PRESETS
from lippmann.job.spec import CONSTANT_FIELDS, JobSpec
from tests.builders_service import Client

JOB = "/api/v1/schemas/job"


def fields_of(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, model in {"": schema, **schema["$defs"]}.items():
        yield from ((f"{name}.{field}", about) for field, about in model.get("properties", {}).items())


def test_every_field_of_a_job_and_of_its_outputs_has_a_label_and_a_description(api: Client) -> None:
    found = dict(fields_of(api.get(JOB).json()))
    assert ".scene" in found
    assert "ViewsVideo.codec" in found
    bare = [name for name, about in found.items() if not about.get("title")]
    mute = [name for name, about in found.items() if not about.get("description") and "const" not in about]
    assert (bare, mute) == ([], [])


def test_a_field_has_its_unit_once(api: Client) -> None:
    array = api.get(JOB).json()["$defs"]["LensArray"]["properties"]
    assert (array["offset_mm"]["title"], array["offset_mm"]["unit"]) == ("Offset", "mm")
    assert "unit" not in array["index"]
    assert [item["title"] for item in array["count"]["prefixItems"]] == ["Rows", "Columns"]


def test_the_schema_is_that_of_the_model_with_the_published_lenses(api: Client) -> None:
    served = api.get(JOB).json()
    assert "athineos-2006" in served["$defs"]["Rig"]["properties"]["imaging_lens"].pop("examples")
    expected = JobSpec.model_json_schema()
    assert served["properties"].keys() == expected["properties"].keys()
    assert served["$defs"].keys() == expected["$defs"].keys()


def test_the_numbers_of_a_design_that_the_page_shows_are_explained(api: Client) -> None:
    fields = api.get("/api/v1/schemas/design").json()["properties"]
    shown = ("efl_mm", "image_depth_mm", "views", "viewing_angle_deg", "viewing_zone_mm", "width_mm", "frame_cpu_s")
    assert all(fields[name].get("description") for name in shown)


def test_the_rule_which_numbers_may_have_keyframes_comes_with_the_schema_of_a_job_file(api: Client) -> None:
    rule = {"parts": list(ANIMATED_PARTS), "constant": list(CONSTANT_FIELDS)}
    assert api.get(JOB).json()["animation"] == rule


def test_the_presets_come_with_the_schema_of_a_job_file(api: Client) -> None:
    presets = api.get(JOB).json()["presets"]
    assert [preset["name"] for preset in presets] == list(PRESETS)
    assert api.get(JOB).json()["lens_arrays"] == LENS_ARRAYS
    assert all(preset["title"] and preset["description"] and preset["job"]["scene"] for preset in presets)


@pytest.mark.parametrize("name", ["job", "design"])
def test_an_unchanged_schema_is_not_sent_again(api: Client, name: str) -> None:
    etag = api.get(f"/api/v1/schemas/{name}").headers["ETag"]
    again = api.get(f"/api/v1/schemas/{name}", headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")


def test_there_is_no_other_schema(api: Client) -> None:
    assert api.get("/api/v1/schemas/farm").status_code == 422
