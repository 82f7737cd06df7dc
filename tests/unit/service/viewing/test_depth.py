"""Depths of a frame over HTTP: those of a plane that is known, and those of the pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.lightfield.depth.view_depth import estimated_depth
from lippmann.lightfield.views.views import centre
from lippmann.plan.design.sharp_maps import focus_of_estimate, focus_of_scene, view_of
from lippmann.plan.sampling import display_size
from tests.builders_service import CARD, Client, Farm
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from worker.images.write import write_channels, write_exr

RIG: dict[str, Any] = {"lens_array": {"count": [24, 20]}, "px_per_lens": 8}
LAYOUT = display_size(Rig.model_validate(RIG))
DEPTH_MM = 20.0
"""The depth of the plane in the pictures."""
SCENE_MM = 1100.0
"""The distance of the plane that the depth master tells."""


def waves(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.5 + 0.2 * np.sin(1.3 * x + 0.4 * y) + 0.2 * np.sin(1.1 * y - 0.5 * x)


def stored(farm: Farm, tmp_path: Path, *, has_depth: bool) -> str:
    """Return a job of two frames, the first of them assembled: a plane, without anything at its right edge."""
    job_id = farm.submit(rig=RIG, frames="1-2", render={}, capture={"depth": has_depth})
    light = sheet_of_texture(LAYOUT, waves, DEPTH_MM, focal_mm=3.3).repeat(3, axis=2)
    write_exr(tmp_path / "sheet.exr", light, attributes={})
    farm.parts.store.put_file(f"{job_id}/orthoscopic/0001.exr", tmp_path / "sheet.exr")
    if has_depth:
        values = np.full((LAYOUT.rows, LAYOUT.cols, 4), SCENE_MM, np.float32)
        values[:, -4 * LAYOUT.px_per_lens :] = np.nan
        write_channels(tmp_path / "depth.exr", [values], CHANNELS, size=(LAYOUT.rows, LAYOUT.cols), attributes={})
        farm.parts.store.put_file(f"{job_id}/depth/0001.exr", tmp_path / "depth.exr")
    return job_id


def numbers(pfm: bytes) -> NDArray[np.float32]:
    kind, size, scale, values = pfm.split(b"\n", 3)
    assert (kind, scale) == (b"Pf", b"-1")
    cols, rows = map(int, size.split())
    return np.frombuffer(values, "<f4").reshape(rows, cols)[::-1]


@pytest.fixture
def ask(looked: Farm, make_client: Callable[[Farm], Client]) -> Callable[..., Any]:
    api = make_client(looked)
    return lambda job_id, asked, frame=1, **how: api.get(f"/api/v1/jobs/{job_id}/frames/{frame}/{asked}", **how)


def test_the_map_of_a_captured_depth_is_where_the_optics_show_it_sharp(
    looked: Farm, ask: Callable[..., Any], tmp_path: Path
) -> None:
    job_id = stored(looked, tmp_path, has_depth=True)
    plan = ask(job_id, "look").json()["depth_map"]
    assert plan == {"url": f"/api/v1/jobs/{job_id}/frames/1/depth.map", "source": "truth"}
    for query, number in (("", centre(LAYOUT)), ("?u=1&v=6", (1, 6))):
        answer = ask(job_id, f"depth.map{query}")
        assert (answer.status_code, answer.headers["Content-Type"]) == (200, "image/x-portable-floatmap")
        scene_mm = np.full((LAYOUT.lens_rows, LAYOUT.lens_cols), SCENE_MM, np.float32)
        scene_mm[:, -4:] = np.nan
        view = view_of(Rig.model_validate(RIG), CARD.stage, number)
        np.testing.assert_array_equal(numbers(answer.content), focus_of_scene(view, scene_mm))
    again = ask(job_id, "depth.map", headers={"If-None-Match": ask(job_id, "depth.map").headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_the_map_of_pictures_alone_is_estimated(looked: Farm, ask: Callable[..., Any], tmp_path: Path) -> None:
    job_id = stored(looked, tmp_path, has_depth=False)
    assert ask(job_id, "look").json()["depth_map"]["source"] == "estimate"
    found = numbers(ask(job_id, "depth.map").content)
    sheet = sheet_of_texture(LAYOUT, waves, DEPTH_MM, focal_mm=3.3).repeat(3, axis=2).astype(np.float16)
    local = estimated_depth(image_of(sheet, LAYOUT, focal_length_mm=3.3), centre(LAYOUT)).s_mm
    view = view_of(Rig.model_validate(RIG), CARD.stage, centre(LAYOUT))
    np.testing.assert_allclose(found, focus_of_estimate(view, CARD.stage, local, reach=2), atol=1e-3)


def test_a_click_on_the_plane_of_a_captured_depth_is_answered_with_its_place_in_the_scene(
    looked: Farm, ask: Callable[..., Any], tmp_path: Path
) -> None:
    job_id = stored(looked, tmp_path, has_depth=True)
    exact_mm = numbers(ask(job_id, "depth.map").content)[12, 10]
    found = ask(job_id, "depth?x=0.51&y=0.51").json()
    assert (found["source"], found["scene_mm"]) == ("truth", SCENE_MM)
    assert found["depth_mm"] == pytest.approx(exact_mm, abs=0.75 * 3.3)
    # Beside the plane there is no truth, so that the pictures decide.
    beside = ask(job_id, "depth?x=0.95&y=0.5").json()
    assert (beside["source"], beside["scene_mm"]) == ("estimate", None)
    assert beside["depth_mm"] == pytest.approx(DEPTH_MM, abs=2.0)


def test_a_click_into_pictures_alone_finds_the_depth_at_which_they_are_sharp(
    looked: Farm, ask: Callable[..., Any], tmp_path: Path
) -> None:
    job_id = stored(looked, tmp_path, has_depth=False)
    for place in ("x=0.5&y=0.5", "x=0.3&y=0.7&u=1&v=6", "x=1&y=1"):
        found = ask(job_id, f"depth?{place}").json()
        assert (found["source"], found["scene_mm"]) == ("estimate", None)
        assert found["depth_mm"] == pytest.approx(DEPTH_MM, abs=3.3), place


WRONG = (
    ("depth?x=0.5", 422, "y: expected a value, got nothing"),
    ("depth?x=1.5&y=0", 422, "x"),
    ("depth?x=nan&y=0", 422, "x"),
    ("depth?x=0.5&y=0.5&u=8&v=0", 422, "u: expected 0 to 7, got 8"),
    ("depth.map?u=-1", 422, "u: expected 0 to 7, got -1"),
    ("depth.map?w=1", 422, "w: expected one of the parameters u, v"),
)


def test_a_place_or_view_that_does_not_exist_is_said_by_field(
    looked: Farm, ask: Callable[..., Any], tmp_path: Path
) -> None:
    job_id = stored(looked, tmp_path, has_depth=True)
    for asked, status, words in WRONG:
        answer = ask(job_id, asked)
        assert answer.status_code == status, asked
        assert words in answer.json()["detail"]
    assert ask(job_id, "depth?x=0.5&y=0.5", frame=2).status_code == 404


def test_a_depth_master_that_is_cut_short_is_named(looked: Farm, ask: Callable[..., Any], tmp_path: Path) -> None:
    job_id = stored(looked, tmp_path, has_depth=True)
    whole = (tmp_path / "depth.exr").read_bytes()
    looked.parts.store.delete(f"{job_id}/depth/0001.exr")
    looked.parts.store.put_bytes(f"{job_id}/depth/0001.exr", whole[: len(whole) // 2])
    for asked in ("depth.map", "depth?x=0.5&y=0.5"):
        answer = ask(job_id, asked)
        assert (answer.status_code, answer.json()["code"]) == (500, "artifact-broken")
