"""Every kind of video: what is in it, by independent readers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import SpecError
from lippmann.job.outputs.clips import FocusVideo
from lippmann.job.spec import parse_spec
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.stereo import together
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import successive_views, view
from tests.builders_outputs import given_job
from tests.needs import needs_ffprobe
from tests.srgb import linear_of
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from tests.unit.worker.tasks.outputs.films import film, probed
from worker.images.colour import srgb_codes
from worker.tasks.outputs.clips import focus_depths
from worker.tasks.outputs.frame_source import job_frames

FOCAL_MM = 3.3
LAYOUT = CellLayout(lens_rows=12, lens_cols=12, px_per_lens=4)
SMALL: Mapping[str, Any] = {"count": (12, 12), "px_per_lens": 4}
LATTICES = pytest.mark.parametrize("lattice", ["square", "hexagonal"])


def stripe(depth_mm: float, *, layout: CellLayout = LAYOUT) -> NDArray[np.float32]:
    """Return a sheet that shows a bright upright stripe in the middle, at a depth of the display."""
    sheet = sheet_of_texture(layout, lambda x, _: np.exp(-(x**2) / 0.9), depth_mm, focal_mm=FOCAL_MM)
    return np.repeat(sheet, 3, axis=2)


def at_col(picture: NDArray[Any]) -> float:
    """Return the col of the middle of what is bright."""
    codes = picture.astype(float) / 255
    light = linear_of(codes).sum(axis=(0, 2))
    light -= light.min()
    return float((light * np.arange(len(light))).sum() / light.sum())


@needs_ffprobe
@pytest.mark.parametrize(
    ("kind", "more", "sides", "pictures", "fps"),
    [
        ("views", {"views_per_s": 12}, (12, 12), 32, 12),
        ("centre", {"repeat": 3}, (12, 12), 6, 8),
        ("orthoscopic", {}, (48, 48), 2, 8),
        ("integral", {}, (48, 48), 2, 8),
        ("sweep", {"fps": 10, "seconds": 1.5}, (12, 12), 15, 10),
        ("focus", {"fps": 10, "seconds": 1.5}, (12, 12), 15, 10),
        ("stereo", {}, (24, 12), 2, 8),
        ("anaglyph", {"repeat": 2}, (12, 12), 4, 8),
    ],
)
def test_every_kind_comes_in_every_codec_as_large_and_as_long_as_it_says(
    tmp_path: Path, kind: str, more: dict[str, Any], sides: tuple[int, int], pictures: int, fps: int
) -> None:
    files = {"mp4": ("h264", "yuv420p", 1), "webm": ("vp9", "yuv420p", 1), "mkv": ("ffv1", "bgr0", 1)}
    scaled = kind not in ("orthoscopic", "integral")
    outputs = [
        {"kind": kind, "codec": codec, **more, **({"scale": 2 if codec != "ffv1" else 1} if scaled else {})}
        for codec, _, _ in files.values()
    ]
    job = given_job(tmp_path, frames="1-2", outputs=outputs, **SMALL)
    for suffix, (codec, pixel_format, _) in files.items():
        job.make(f"{kind}.{suffix}")
        scale = 2 if scaled and codec != "ffv1" else 1
        with job.file(f"video/{kind}.{suffix}") as path:
            said = probed(path)
        expected = {
            "codec_name": codec,
            "pix_fmt": pixel_format,
            "width": sides[0] * scale,
            "height": sides[1] * scale,
            "avg_frame_rate": f"{fps}/1",
            "nb_read_frames": str(pictures),
            "color_space": "gbr" if codec == "ffv1" else "bt709",
        }
        assert {name: said[name] for name in expected} == expected
        assert said["duration_s"] == pytest.approx(pictures / fps, abs=2e-3)
        assert job.sidecar(f"{kind}.{suffix}")["files"] == [f"video/{kind}.{suffix}"]


@LATTICES
@pytest.mark.parametrize("bits", [8, 10, 16])
def test_integral_orthoscopic_and_views_are_lossless_as_ffv1(tmp_path: Path, lattice: str, bits: int) -> None:
    kinds = ("integral", "orthoscopic", "views")
    outputs = [{"kind": kind, "codec": "ffv1", "bits": bits} for kind in kinds]
    job = given_job(tmp_path, frames="1-2", outputs=outputs, lens_array={"lattice": lattice})
    sheets = [job.stored_sheet(frame) for frame in (1, 2)]
    captured = [orthoscopic(sheet, job.layout) for sheet in sheets]
    views = [
        as_square(view(sheet, job.layout, u, v), job.layout)
        for backward, sheet in enumerate(sheets)
        for u, v in successive_views(job.layout, backward=bool(backward))
    ]
    for kind, expected in zip(kinds, (captured, sheets, views), strict=True):
        made = film(job, f"{kind}.mkv")
        np.testing.assert_array_equal(made, [srgb_codes(picture, bits=bits) for picture in expected])


def test_flat_colours_come_back_through_bt709(tmp_path: Path) -> None:
    codes = np.array([[230, 20, 20], [30, 200, 40], [20, 40, 220], [128, 128, 128]], dtype=float) / 255
    light = linear_of(codes)
    sheet = np.repeat(np.repeat(light[np.newaxis], 48, axis=0), 12, axis=1).astype(np.float32)
    outputs = [
        {"kind": "centre", "scale": 8},
        {"kind": "centre", "codec": "vp9", "scale": 8},
        {"kind": "centre", "codec": "av1", "scale": 8, "name": "av1"},
        {"kind": "centre", "codec": "av1", "bits": 10, "container": "webm", "scale": 8, "name": "av1"},
        {"kind": "centre", "codec": "h265", "chroma": "4:4:4", "scale": 8, "name": "h265", "filter": "box"},
    ]
    job = given_job(tmp_path, {1: sheet}, outputs=outputs, **SMALL)
    for output in job.sheet.spec.outputs:
        made = film(job, output.file_name)[0].astype(int)
        middles = made[48, [12, 36, 60, 84]]
        # A code of Cb more or less is two of blue, and the encoders may be off by two.
        assert np.abs(middles - np.rint(codes * 255)).max() <= 6, output.file_name


@pytest.mark.parametrize(("name", "widens"), [("box", False), ("triangle", True)])
def test_a_named_filter_enlarges_linear_light(tmp_path: Path, name: str, widens: bool) -> None:
    outputs = [{"kind": "centre", "codec": "ffv1", "scale": 4, "filter": name}]
    sheet = np.repeat((np.arange(48) >= 24).astype(np.float32)[np.newaxis, :, np.newaxis], 48, axis=0)
    made = film(given_job(tmp_path, {1: np.repeat(sheet, 3, axis=2)}, outputs=outputs, **SMALL), "centre.mkv")[0]
    line = made[24, :, 0].astype(int)
    assert (line[:20] == 0).all()
    assert (line[28:] == 255).all()
    between = line[20:28]
    assert (set(between) == {0, 255}) != widens
    if widens:  # an eighth, three, five and seven eighths of the light: 255 times their sRGB
        assert between.tolist()[2:6] == [99, 165, 207, 240]


def test_the_sweep_swings_to_the_right_and_back_and_what_is_before_the_display_goes_to_the_left(tmp_path: Path) -> None:
    outputs = [{"kind": "sweep", "codec": "ffv1", "fps": 8, "seconds": 1, "extent": 1.0}]
    for depth_mm, sign in ((15.0, -1), (-15.0, 1)):
        job = given_job(tmp_path / str(sign), {1: stripe(depth_mm)}, outputs=outputs, **SMALL)
        cols = [at_col(picture) - 5.5 for picture in film(job, "sweep.mkv")]
        # Eye at 0, 0.71, 1, 0.71, 0, ... of 1.5 views, each of which moves the stripe by s / (n f) lenses.
        step = sign * abs(depth_mm) / (4 * FOCAL_MM)
        expected = [1.5 * np.sin(2 * np.pi * moment / 8) * step for moment in range(8)]
        assert cols == pytest.approx(expected, abs=0.15)


@LATTICES
@pytest.mark.parametrize("path", ["horizontal", "vertical", "circle"])
def test_a_sweep_at_a_distance_sees_every_lens(tmp_path: Path, lattice: Lattice, path: str) -> None:
    layout = CellLayout(9, 9, px_per_lens=6, lattice=lattice)
    output = {"kind": "sweep", "codec": "ffv1", "path": path, "fps": 6, "seconds": 2, "distance_mm": 150, "extent": 1}
    white = np.ones((layout.rows, layout.cols, 3), np.float32)
    more: dict[str, Any] = {"lens_array": {"lattice": lattice}, "count": (9, 9), "px_per_lens": 6}
    job = given_job(tmp_path, {1: white}, outputs=[output], **more)
    assert film(job, "sweep.mkv").min() == 255


def test_a_sweep_begins_where_it_ends_and_keeps_the_speed_of_the_scene(tmp_path: Path) -> None:
    sheets = {frame: np.full((48, 48, 3), frame / 4, np.float32) for frame in (1, 2, 3)}
    outputs = [
        {"kind": "sweep", "codec": "ffv1", "fps": 24},
        {"kind": "sweep", "codec": "ffv1", "fps": 24, "frame": 3, "name": "held", "periods": 2, "seconds": 0.5},
    ]
    job = given_job(tmp_path, sheets, frames="1-3", fps=8, outputs=outputs, **SMALL)
    made = film(job, "sweep.mkv")[:, 5, 5, 0]
    # Three frames at 8 a second are 3/8 s: eleven times that is at least the 4 s of a swing.
    assert made.tolist() == np.repeat([137, 188, 225], 3).tolist() * 11
    assert film(job, "held.mkv")[:, 5, 5, 0].tolist() == [225] * 12


def test_sidecars_say_where_eyes_and_focus_are(tmp_path: Path) -> None:
    focus = {"kind": "focus", "codec": "ffv1", "from_mm": -5, "fps": 2, "seconds": 1}
    job = given_job(tmp_path, outputs=[focus, "stereo.mkv"], **SMALL)
    job.make("stereo.mkv")
    assert job.sidecar("stereo.mkv")["format"] == {"eyes_mm": [[-31.5, 0, 1000], [31.5, 0, 1000]]}
    job.make("focus.mkv")
    assert {"from_mm": -5, "to_mm": pytest.approx(43.3)}.items() <= job.sidecar("focus.mkv")["format"].items()


def test_the_focus_runs_from_depth_to_depth_and_back(tmp_path: Path) -> None:
    options = {"from_mm": -12, "to_mm": 15, "planes": 10, "fps": 18, "seconds": 1}
    job = given_job(tmp_path, {1: stripe(15.0)}, outputs=[{"kind": "focus", "codec": "ffv1", **options}], **SMALL)
    made = film(job, "focus.mkv")
    np.testing.assert_array_equal(made[1:9], made[:9:-1])
    # Sharpest, hence brightest, where the stripe is: half-way through the clip, which the pendulum passes slowly.
    brightest = made.max(axis=(1, 2, 3))
    assert brightest.argmax() == 8
    assert brightest.tolist()[8:11] == [brightest.max()] * 3
    assert brightest[9] > 1.5 * brightest[0]
    stack = focal_stack(image_of(job.stored_sheet(1), job.layout, focal_length_mm=FOCAL_MM), [-12.0, 15.0])
    np.testing.assert_array_equal(made[[0, 9]], srgb_codes(stack.reshape(-1, 12, 3)).reshape(stack.shape))


def test_the_focus_runs_through_the_depth_of_the_scene_when_nothing_is_said(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=["focus.mp4"], **SMALL)
    source = job_frames(job.artifacts, job.sheet)
    stage = job.sheet.stage
    # The paper's bench: what is at stage.near_mm comes out at its image's place, and 3.3 mm before that on the display.
    (output,) = job.sheet.spec.outputs
    assert isinstance(output, FocusVideo)
    far_mm, near_mm = focus_depths(source, output)
    assert (
        far_mm < near_mm == pytest.approx(40 + FOCAL_MM if stage.reference_mm == stage.near_mm else near_mm, abs=1e-9)
    )


def test_the_left_eye_is_on_the_left_and_what_is_before_the_display_crosses(tmp_path: Path) -> None:
    eyes = {"eye_distance_mm": 60, "distance_mm": 300}
    outputs = [
        {"kind": "stereo", "codec": "ffv1", **eyes},
        {"kind": "stereo", "codec": "ffv1", **eyes, "order": "cross_eyed", "name": "crossed"},
        {"kind": "stereo", "codec": "ffv1", **eyes, "packing": "half", "name": "half"},
    ]
    for depth_mm in (15.0, -15.0):
        job = given_job(tmp_path / str(depth_mm), {1: stripe(depth_mm)}, outputs=outputs, **SMALL)
        parallel, crossed = film(job, "stereo.mkv")[0], film(job, "crossed.mkv")[0]
        np.testing.assert_array_equal(parallel, np.hstack((crossed[:, 12:], crossed[:, :12])))
        left, right = at_col(parallel[:, :12]) - 5.5, at_col(parallel[:, 12:]) - 5.5
        # An eye at x sees a point in the middle at s where its ray meets the display: x s / (s - L), in lenses of 1 mm.
        expected = 30 * depth_mm / (depth_mm - 300)
        assert right == pytest.approx(expected, abs=0.1)
        assert left == pytest.approx(-expected, abs=0.1)
        half = film(job, "half.mkv")[0]
        assert half.shape == (24, 24, 3)
        assert at_col(half[:, :12]) == pytest.approx(left + 5.5, abs=0.3)


def test_half_the_width_is_half_the_width_and_twice_as_high_without_loss(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=[{"kind": "stereo", "packing": "half", "scale": 6}], **SMALL)
    assert film(job, "stereo.mp4").shape == (1, 72, 72, 3)


def test_views_may_stand_for_eyes_and_the_anaglyph_is_made_of_them(tmp_path: Path) -> None:
    views = {"views": [[0, 2], [3, 1]]}
    outputs = [{"kind": kind, "codec": "ffv1", **views} for kind in ("stereo", "anaglyph")]
    job = given_job(tmp_path, outputs=outputs, **SMALL)
    left, right = (view(job.stored_sheet(1), job.layout, *place) for place in ((0, 2), (3, 1)))
    np.testing.assert_array_equal(film(job, "stereo.mkv")[0], srgb_codes(np.hstack((left, right))))
    np.testing.assert_array_equal(film(job, "anaglyph.mkv")[0], srgb_codes(together(left, right, "anaglyph")))


@LATTICES
def test_hexagonal_views_are_put_on_square_pixels(tmp_path: Path, lattice: str) -> None:
    outputs = [
        {"kind": "sweep", "codec": "ffv1", "fps": 4, "seconds": 1},
        {"kind": "focus", "codec": "ffv1", "fps": 4, "seconds": 1, "from_mm": -5, "to_mm": 5},
        {"kind": "stereo", "codec": "ffv1"},
        {"kind": "anaglyph", "codec": "ffv1"},
    ]
    job = given_job(tmp_path, outputs=outputs, count=(11, 10), px_per_lens=6, lens_array={"lattice": lattice})
    rows, cols = job.layout.square_size()
    for kind in ("sweep", "focus", "anaglyph"):
        assert film(job, f"{kind}.mkv").shape[1:3] == (rows, cols)
    assert film(job, "stereo.mkv").shape[1:3] == (rows, 2 * cols)


def test_a_viewing_distance_nearer_than_two_eyes_can_use_is_refused_when_the_job_comes(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"outputs\.0\.distance_mm: expected at least 207\.9 mm.* got 200 mm"):
        given_job(tmp_path, outputs=["stereo.mp4"], display={"viewing_distance_mm": 200}, **SMALL)


@pytest.mark.parametrize(
    ("output", "problem"),
    [
        ("views.avi", r"outputs\.0: expected an object with a kind, or one of .*'views\.webm'.*, got 'views\.avi'"),
        ({"kind": "views", "codec": "divx"}, r"outputs\.0\.codec: expected 'h264', 'h265', 'av1', 'vp9' or 'ffv1'"),
        ({"kind": "views", "codec": "vp9", "container": "mp4"}, r"\.container: expected webm or mkv for vp9"),
        ({"kind": "views", "bits": 10}, r"outputs\.0\.bits: expected 8 for h264, got 10"),
        ({"kind": "views", "codec": "av1", "chroma": "4:4:4"}, r"\.chroma: expected 4:2:0 for av1, got '4:4:4'"),
        ({"kind": "views", "codec": "ffv1", "chroma": "4:2:0"}, r"\.chroma: expected none for ffv1, which keeps RGB"),
        ({"kind": "views", "crf": 52}, r"outputs\.0\.crf: expected 1 to 51 for h264, got 52"),
        ({"kind": "views", "codec": "ffv1", "crf": 5}, r"\.crf: expected none for ffv1, which loses nothing, got 5"),
        ({"kind": "views", "views_per_s": 0}, r"outputs\.0\.views_per_s: expected a number above 0, got 0"),
        ({"kind": "sweep", "fps": -1}, r"outputs\.0\.fps: expected a number above 0, got -1"),
        ({"kind": "sweep", "frame": 3}, r"outputs\.0\.frame: expected one of the job's frames, 1-2, got 3"),
        ({"kind": "sweep", "distance_mm": 40}, r"\.distance_mm: expected at least 48\.4 mm.* got 40 mm"),
        ({"kind": "focus", "to_mm": 500}, r"outputs\.0\.to_mm: expected at most 145\.2 mm.* got 500 mm"),
        ({"kind": "focus", "from_mm": 5, "to_mm": 5}, r"\.to_mm: expected another depth than from_mm, got 5 mm"),
        ({"kind": "stereo", "eye_distance_mm": 0}, r"\.eye_distance_mm: expected a number above 0, got 0"),
        ({"kind": "stereo", "distance_mm": -5}, r"\.distance_mm: expected a number above 0, got -5"),
        ({"kind": "stereo", "distance_mm": 200}, r"\.distance_mm: expected at least 207\.9 mm.* got 200 mm"),
        ({"kind": "anaglyph", "views": [[0, 0], [4, 0]]}, r"\.views\.1: expected a view from \(0, 0\) to \(3, 3\)"),
        ({"kind": "anaglyph", "views": [[0, 0], [1, 0]], "distance_mm": 900}, r"\.views: expected either these"),
        ({"kind": "stereo", "packing": "half", "scale": 3}, r"\.scale: expected an even number with packing half"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_named_by_field_when_the_job_comes(output: Any, problem: str) -> None:
    job = {
        "scene": "fish",
        "frames": "1-2",
        "outputs": [output],
        "rig": {"lens_array": {"count": [12, 12]}, "px_per_lens": 4},
    }
    with pytest.raises(SpecError, match=problem):
        parse_spec(job)


@pytest.mark.parametrize(("kind", "scale", "px"), [("views", 60, 9000), ("stereo", 28, 8400)])
def test_a_picture_larger_than_players_show_is_refused(kind: str, scale: int, px: int) -> None:
    job = {"scene": "fish", "outputs": [{"kind": kind, "scale": scale}], "rig": {"lens_array": {"count": [9, 150]}}}
    with pytest.raises(SpecError, match=rf"outputs\.0\.scale: expected a picture of at most 8192 px .* got {px} px"):
        parse_spec(job)
