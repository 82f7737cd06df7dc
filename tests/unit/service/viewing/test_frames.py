"""Looking into frames over HTTP: the pictures are made when they are asked for, by the real pixels."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.job.spec import JobSpec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.refocus.shift_and_sum import refocus
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view
from lippmann.plan.design.observed_display import observed_display
from lippmann.plan.sampling import display_size
from service.main import create_app
from service.viewing.sheet_cache import SheetCache
from service.viewing.viewable_frame import ViewableFrame
from tests.builders_service import CARD, Client, FakePictures, Farm
from tests.unit.lippmann.lightfield.sheets import image_of
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.images.write import write_exr

RIG: dict[str, Any] = {"lens_array": {"count": [12, 10], "lattice": "square"}, "px_per_lens": 4}


def stored(farm: Farm, tmp_path: Path, **rig: Any) -> tuple[str, NDArray[np.float16], CellLayout]:
    """Return a job of two frames, the first of them assembled; its sheet and layout."""
    job_id = farm.submit(rig=RIG | rig, frames="1-2", render={})
    layout = display_size(JobSpec.model_validate({"scene": "ball", "rig": RIG | rig}).rig)
    light = np.random.default_rng(1).random((layout.rows, layout.cols, 3), dtype=np.float32)
    write_exr(tmp_path / "sheet.exr", light, attributes={})
    farm.parts.store.put_file(f"{job_id}/orthoscopic/0001.exr", tmp_path / "sheet.exr")
    return job_id, light.astype(np.float16), layout


def observed(sheet: NDArray[np.float16], *, gap_mm: float | None = None, **how: Any) -> NDArray[np.floating[Any]]:
    display = observed_display(JobSpec.model_validate({"scene": "ball", "rig": RIG}).rig, gap_mm=gap_mm)
    eye = Eye(x_mm=-20.0, y_mm=5.0, distance_mm=400.0)
    return observed_picture(
        sheet, display, eye, ViewingConditions(rays=4, **how), window=whole_window(display, size_px=40)
    )


def codes(data: bytes) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def test_what_is_seen_is_what_the_library_makes_of_the_sheet(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, sheet, layout = stored(looked, tmp_path)
    eye = Eye(x_mm=-20.0, y_mm=5.0, distance_mm=400.0)
    expected = {
        "view?u=1&v=3": view(sheet, layout, 1, 3),
        "view": view(sheet, layout, *centre(layout)),
        "perspective?x=-20&y=5&z=400": perspective(
            image_of(sheet, layout, pitch_mm=1.0, focal_length_mm=3.3), eye
        ).picture,
        "refocus?depth_mm=-7.5": refocus(image_of(sheet, layout, focal_length_mm=3.3), -7.5),
        "observer?x=-20&y=5&z=400&size=40&rays=4&stereo=side_by_side": observed(sheet, stereo="side_by_side"),
        "observer?x=-20&y=5&z=400&size=40&rays=4&gap_mm=3.7&focus_mm=20": observed(sheet, gap_mm=3.7, focus_mm=20.0),
    }
    for asked, light in expected.items():
        answer = api.get(f"/api/v1/jobs/{job_id}/frames/1/{asked}")
        assert (answer.status_code, answer.headers["Content-Type"]) == (200, "image/png"), asked
        np.testing.assert_array_equal(codes(answer.content), srgb_codes(light), err_msg=asked)


def test_the_first_atlas_is_small_and_has_the_outermost_views(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, _, layout = stored(looked, tmp_path, lens_array=RIG["lens_array"] | {"count": [130, 80]}, px_per_lens=8)
    said = api.get(f"/api/v1/jobs/{job_id}/frames/1/look").json()
    whole, first = said["atlas"], said["first_atlas"]
    assert (len(whole["us"]), len(whole["vs"])) == (layout.cell_cols, layout.cell_rows)
    assert max(first["rows"], first["cols"]) <= 540 < max(whole["rows"], whole["cols"])
    assert (first["us"][0], first["us"][-1]) == (0, layout.cell_cols - 1)
    assert codes(api.get(f"{first['url']}&format=webp").content).shape == (first["rows"], first["cols"], 3)
    small = api.get(f"/api/v1/jobs/{stored(looked, tmp_path)[0]}/frames/1/look").json()
    assert small["first_atlas"] == small["atlas"]


def test_as_exr_the_light_comes_linear_and_exact(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, sheet, layout = stored(looked, tmp_path)
    asked = {
        "view?u=1&v=3": view(sheet, layout, 1, 3),
        "refocus?depth_mm=-7.5": refocus(image_of(sheet, layout, focal_length_mm=3.3), -7.5),
        "observer?x=-20&y=5&z=400&size=40&rays=4&stereo=anaglyph": observed(sheet, stereo="anaglyph"),
    }
    for query, light in asked.items():
        url = f"/api/v1/jobs/{job_id}/frames/1/{query}"
        answer = api.get(f"{url}&format=exr")
        assert (answer.status_code, answer.headers["Content-Type"]) == (200, "image/x-exr"), query
        assert answer.headers["ETag"] != api.get(url).headers["ETag"]
        (tmp_path / "seen.exr").write_bytes(answer.content)
        np.testing.assert_array_equal(read_rgb(tmp_path / "seen.exr", np.float32), light.astype(np.float32))
    url = f"/api/v1/jobs/{job_id}/frames/1"
    assert api.get(f"{url}/views.atlas?format=exr").json()["errors"][0]["field"] == "format"


def test_an_exr_is_not_enlarged_beyond_what_twelve_bytes_a_pixel_allow(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, *_ = stored(looked, tmp_path, lens_array=RIG["lens_array"] | {"count": [130, 4]})
    url = f"/api/v1/jobs/{job_id}/frames/1/view?scale=32&filter=box"
    assert api.get(url).status_code == 200
    problem = api.get(f"{url}&format=exr").json()["errors"][0]
    assert (problem["field"], problem["got"]) == ("scale", "4160 px")


def test_the_atlas_lies_as_the_description_says_on_a_hexagonal_lattice_too(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, sheet, layout = stored(looked, tmp_path, lens_array=RIG["lens_array"] | {"lattice": "hexagonal"})
    said = api.get(f"/api/v1/jobs/{job_id}/frames/1/look?max_px=64").json()
    assert (said["us"], said["vs"]) == (layout.cell_cols, layout.cell_rows)
    atlas = codes(api.get(said["atlas"]["url"]).content)
    assert atlas.shape == (said["atlas"]["rows"], said["atlas"]["cols"], 3)
    col, row = len(said["atlas"]["us"]) // 2, len(said["atlas"]["vs"]) // 2
    u, v = said["atlas"]["us"][col], said["atlas"]["vs"][row]
    shown = atlas[row * said["view_rows"] :, col * said["view_cols"] :][: said["view_rows"], : said["view_cols"]]
    np.testing.assert_array_equal(shown, srgb_codes(as_square(view(sheet, layout, u, v), layout)))
    u, v = said["missing"][0]
    assert api.get(f"/api/v1/jobs/{job_id}/frames/1/view?u={u}&v={v}").status_code == 422


def test_a_picture_comes_enlarged_and_as_webp(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, sheet, layout = stored(looked, tmp_path)
    url = f"/api/v1/jobs/{job_id}/frames/1/view?u=0&v=0&scale=3&filter=box"
    large = codes(api.get(url).content)
    small = srgb_codes(view(sheet, layout, 0, 0))
    np.testing.assert_allclose(large, small.repeat(3, axis=0).repeat(3, axis=1), atol=1)
    answer = api.get(f"{url}&format=webp")
    assert answer.headers["Content-Type"] == "image/webp"
    assert codes(answer.content).shape == large.shape


def test_what_the_caller_has_seen_is_not_made_again_until_the_sheet_or_the_question_changes(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, *_ = stored(looked, tmp_path)
    url = f"/api/v1/jobs/{job_id}/frames/1/view"
    etag = api.get(url, params={"u": 1, "v": 1}).headers["ETag"]
    again = api.get(url, params={"v": 1, "u": 1}, headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")
    assert api.get(url, params={"u": 1, "v": 2}, headers={"If-None-Match": etag}).status_code == 200
    write_exr(tmp_path / "other.exr", np.zeros((48, 40, 3), np.float16), attributes={})
    looked.parts.store.delete(f"{job_id}/orthoscopic/0001.exr")
    looked.parts.store.put_file(f"{job_id}/orthoscopic/0001.exr", tmp_path / "other.exr")
    changed = api.get(url, params={"u": 1, "v": 1}, headers={"If-None-Match": etag})
    assert (changed.status_code, codes(changed.content).max()) == (200, 0)


UNSEEN = (
    ("1/view?u=4&v=0", 422, "u: expected 0 to 3, got 4"),
    ("1/view?u=0&v=-1", 422, "v: expected 0 to 3, got -1"),
    ("1/view?uu=1", 422, "uu: expected one of the parameters filter, format, scale, u, v"),
    ("1/view?scale=0", 422, "scale"),
    ("1/view?filter=cubic", 422, "filter"),
    ("1/perspective?z=-100", 422, "z: expected an eye in front of the display, above 0, got -100"),
    ("1/perspective?x=nan", 422, "x"),
    ("1/observer?pupil_mm=0", 422, "pupil_mm"),
    ("1/observer?gap=real&gap_mm=3", 422, "gap: expected only one of gap and gap_mm, got both"),
    ("1/observer?z=100&focus_mm=100", 422, "expected a focus nearer to the display than the eye"),
    ("1/observer?gap=sideways", 422, "gap"),
    ("1/refocus", 422, "depth_mm: expected a value, got nothing"),
    ("1/refocus?depth_mm=9999", 422, "expected a depth at which neighbouring views"),
    ("1/views.atlas?max_px=11", 422, "max_px"),
    ("1/look?max_px=11", 422, "max_px"),
    ("2/view", 404, "not assembled yet"),
    ("3/view", 404, "has the frames 1-2, not 3"),
)


def test_what_cannot_be_seen_is_said_by_field(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, *_ = stored(looked, tmp_path)
    for asked, status, words in UNSEEN:
        answer = api.get(f"/api/v1/jobs/{job_id}/frames/{asked}")
        assert answer.status_code == status, asked
        assert words in answer.json()["detail"]


def test_a_sheet_that_is_cut_short_is_named_and_not_kept(
    looked: Farm, make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    api = make_client(looked)
    job_id, *_ = stored(looked, tmp_path)
    whole = (tmp_path / "sheet.exr").read_bytes()
    looked.parts.store.put_bytes(f"{job_id}/orthoscopic/0002.exr", whole[: len(whole) // 2])
    answer = api.get(f"/api/v1/jobs/{job_id}/frames/2/view")
    assert (answer.status_code, answer.json()["code"]) == (500, "artifact-broken")


@pytest.mark.promise("People", "A picture on demand that kills its process or never ends costs others nothing.")
def test_a_picture_that_takes_too_long_is_answered_with_when_to_ask_again(
    make_looked: Callable[..., Farm], make_client: Callable[[Farm], Client], tmp_path: Path
) -> None:
    looked = make_looked(picture_timeout_s=0.001)
    api = make_client(looked)
    job_id, *_ = stored(looked, tmp_path)
    answer = api.get(f"/api/v1/jobs/{job_id}/frames/1/view")
    assert (answer.status_code, answer.json()["code"]) == (503, "picture-failed")
    assert answer.json()["detail"] == "the picture took longer than 0.001 s and was given up"
    assert int(answer.headers["Retry-After"]) > 0


def test_only_as_many_sheets_are_kept_as_there_is_room_for() -> None:
    read: list[str] = []

    class Pictures(FakePictures):
        def light(self, path: Path) -> NDArray[np.float16]:
            read.append(path.name)
            return np.zeros((10, 10, 3), np.float16)

    sheets = SheetCache(Pictures(), room_bytes=1200)
    spec = JobSpec(scene="ball")
    first, second, third = (ViewableFrame(1, spec, CARD.stage, name, "e") for name in "abc")
    for viewable in (first, second, first, third, first, second):
        sheets.sheet(viewable, partial(Path, viewable.sheet_name))
    assert read == ["a", "b", "c", "b"]


def test_a_sheet_that_memory_may_not_hold_is_refused_before_it_is_read(
    looked: Farm, make_client: Callable[[Farm], Client]
) -> None:
    api = make_client(looked)
    job_id = looked.submit(rig={"lens_array": {"count": [1200, 1200]}, "px_per_lens": 16}, frames="1")
    answer = api.get(f"/api/v1/jobs/{job_id}/frames/1/refocus", params={"depth_mm": 1})
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid")
    assert "frame: expected an integral image of at most 134217728 px" in answer.json()["detail"]
    assert "got 19200 x 19200 px" in answer.json()["detail"]


def test_a_look_needs_a_key(looked: Farm) -> None:
    app = create_app(looked.settings, looked.parts, clock=lambda: looked.now_s)
    with Client(app) as nobody:
        assert nobody.get("/api/v1/jobs/x/frames/1/view").status_code == 401
