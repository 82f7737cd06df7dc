"""Whole frames through the optics: upright, seamless, with the parallax of the exact trace."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre as middle_view
from lippmann.lightfield.views.views import view
from lippmann.optics.rig.bench import bench, object_rays, pixel_centres_mm
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size, frame_size
from povtemplates.catalogue import scene_folders
from tests.builders import (
    local_place,
    order_of,
    rendered_codes,
    small_job,
    stored_job,
    stored_picture,
    tiles_of,
)
from worker.images.read import read_rgb
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile


def captured(folder: Path, spec: JobSpec) -> dict[str, NDArray[np.float16]]:
    """Render and assemble a frame as a worker does; return its masters by name."""
    place = local_place(folder)
    stored_job(place, spec)
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    kept = {
        "integral": names.integral_name(1),
        "orthoscopic": names.orthoscopic_name(1),
        "views": names.views_name(1),
    }
    if spec.rig.device is not None:
        kept["device"] = names.device_name(1)
    return {what: stored_picture(place, name) for what, name in kept.items()}


def luminance(linear: NDArray[np.float16]) -> NDArray[np.float64]:
    return linear.astype(np.float64) @ [0.2126, 0.7152, 0.0722]


DIRECT_PICKUP = {
    "rig": {"imaging_lens": None},
    "lens_array": {"pitch_mm": 6.0, "focal_length_mm": 20, "offset_mm": -30.0},
}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"camera": {"projection": "perspective"}},
        {"lens_array": {"lattice": "hexagonal"}, "count": (91, 88)},
        {"capture": {"method": "ray_camera"}},
        DIRECT_PICKUP,
        DIRECT_PICKUP | {"camera": {"projection": "perspective", "angle_deg": 20}},
    ],
    ids=["orthographic", "perspective", "hexagonal", "ray camera", "direct pickup", "direct pickup, perspective"],
)
def test_the_letter_f_is_upright_and_not_mirrored(tmp_path: Path, changes: dict[str, Any]) -> None:
    """The target has a red square at the top left, a green one at the top right, a blue one at the bottom left."""
    wanted: dict[str, Any] = {"count": (90, 90), "px_per_lens": 4}
    spec = small_job("target-letter", **wanted | changes)
    upright = captured(tmp_path, spec)["orthoscopic"].astype(np.float64)
    layout = display_size(spec.rig)
    centre = as_square(view(upright, layout, *middle_view(layout)), layout)
    corners = {"red": (0, 0), "green": (0, 1), "blue": (1, 0)}
    for channel, (name, (down, right)) in enumerate(corners.items()):
        others = [other for other in range(3) if other != channel]
        pure = (centre[..., channel] > 0.5) & (centre[..., others] < 0.2).all(axis=-1)
        rows, cols = np.nonzero(pure)
        assert len(rows) > 10, name
        assert (rows.mean() > centre.shape[0] / 2, cols.mean() > centre.shape[1] / 2) == (bool(down), bool(right)), name
    white = (centre > 0.5).all(axis=-1)
    rows, cols = np.nonzero(white)
    middle = (cols.min() + cols.max()) / 2
    assert (cols < middle).mean() > 0.6, "the stem of the F stands on the left"
    assert (rows < (rows.min() + rows.max()) / 2).mean() > 0.55, "its arms are in the upper half"


@pytest.mark.parametrize(
    ("tiles", "changes"),
    [
        ([1, 2], {}),
        ([3, 1], {}),
        ([4, 5], {}),
        ([3, 2], {"lens_array": {"lattice": "hexagonal"}}),
        ([3, 2], {"lens_array": {"lattice": "hexagonal"}, "capture": {"supersample": 2}}),
        ([3, 2], {"capture": {"method": "glass"}}),
        ([4, 3], {"rig": {"imaging_lens": {"name": "double-gauss-tronnier", "focal_length_mm": 300}, "f_number": 4}}),
        ([2, 2], {"render": {"antialias": {"threshold": 0.1, "method": 2, "depth": 3}}}),
    ],
)
def test_tiles_equal_the_whole_pixel_for_pixel(tmp_path: Path, tiles: list[int], changes: dict[str, Any]) -> None:
    whole = captured(tmp_path / "whole", small_job("fish", count=(12, 12), **changes))
    cut = captured(tmp_path / "cut", small_job("fish", count=(12, 12), tiles=tiles, **changes))
    for name, picture in whole.items():
        assert (cut[name] == picture).all(), name


def test_supersampling_is_the_mean_of_finer_pixels_inside_their_cell(tmp_path: Path) -> None:
    fine = captured(tmp_path / "fine", small_job("fish", count=(12, 12), px_per_lens=12))["integral"]
    coarse = captured(tmp_path / "coarse", small_job("fish", count=(12, 12), px_per_lens=4, capture={"supersample": 3}))
    mean = fine.astype(np.float64).reshape(48, 3, 48, 3, 3).mean(axis=(1, 3))
    assert coarse["integral"] == pytest.approx(mean, rel=1e-3)


def test_a_frame_for_a_printer_is_on_its_grid_too(tmp_path: Path) -> None:
    spec = small_job("target-white", count=(10, 12), px_per_lens=24, rig={"device": {"dpi": 600, "margin_px": 5}})
    assert spec.rig.px_per_lens == 24
    printed = captured(tmp_path, spec)["device"]
    assert printed.shape == (246, 293, 3), "236 and 283 px of lenses, 5 px of margin on each side"
    assert (printed[5:-5, 5:-5] == 1).all()
    assert np.count_nonzero(printed) == 236 * 283 * 3


def test_a_white_scene_is_white_in_every_cell(tmp_path: Path) -> None:
    picture = captured(tmp_path, small_job("target-white", count=(90, 90), px_per_lens=4))["integral"]
    assert picture.min() == picture.max() == 1.0


def test_an_inscribed_aperture_leaves_every_cell_whole_too(tmp_path: Path) -> None:
    """Corners without glass look straight through: white as well, but of the other rays."""
    spec = small_job("target-white", count=(10, 10), px_per_lens=8, lens_array={"aperture": "inscribed"})
    assert captured(tmp_path, spec)["integral"].min() == 1.0


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize(
    ("distance_mm", "offset_mm", "s_mm"),
    [(1000.0, 60.0, 60.0), (1000.0, 40.0, 40.0), (1250.0, 40.0, 23.7), (2500.0, 40.0, -10.1), (2500.0, 10.0, -40.1)],
)
def test_disparity_of_a_point_is_that_of_the_exact_trace(
    tmp_path: Path, lattice: str, distance_mm: float, offset_mm: float, s_mm: float
) -> None:
    """From view to view the picture of a ball wanders as that of the rays that pass its middle closely, within 2 %."""
    spec = small_job(
        "target-points",
        count=(46, 40),
        lens_array={"offset_mm": offset_mm, "lattice": lattice},
        parameters={"distance_mm": distance_mm, "radius_mm": BALL_MM},
    )
    optical_bench, layout = bench(spec.rig, reference_mm=1000.0), display_size(spec.rig)
    rays = object_rays(optical_bench, pixel_centres_mm(optical_bench))
    from_middle = rays.position - np.array([0.0, 0.0, -distance_mm])
    miss_mm = np.linalg.norm(np.cross(from_middle, rays.direction), axis=-1, keepdims=True)
    traced = orthoscopic((miss_mm <= BALL_MM).astype(np.float64), frame_size(spec.rig))
    rendered = luminance(captured(tmp_path, spec)["orthoscopic"])[..., np.newaxis]
    row = layout.cell_rows // 2
    found = [lit_lens_x(view(rendered, layout, u, row), layout) for u in range(8)]
    expected = [lit_lens_x(view(traced, layout, u, row), layout) for u in range(8)]
    step, traced_step = np.polyfit(range(8), found, 1)[0], np.polyfit(range(8), expected, 1)[0]
    assert step == pytest.approx(traced_step, rel=0.02)
    # A paraxial step is -(s + f) / (n f). Spherical aberration brings marginal rays up to 6.4 mm nearer.
    assert s_mm + 3.3 - 7.0 < -traced_step * 8 * 3.3 < s_mm + 3.3 + 0.1


BALL_MM = 10.0


def lens_x(layout: CellLayout) -> NDArray[np.float64]:
    """Return where the lenses stand, (lens_row, lens_col), in pitches to the right."""
    shift = np.array([layout.shift_px(row) / layout.px_per_lens for row in range(layout.lens_rows)])
    places: NDArray[np.float64] = np.arange(layout.lens_cols) + shift[:, np.newaxis]
    return places


def lit_lens_x(picture: NDArray[np.float64], layout: CellLayout) -> float:
    weights = picture[..., 0]
    return float((weights * lens_x(layout)).sum() / weights.sum())


def test_in_the_centre_view_x_grows_to_the_right_and_y_upward(tmp_path: Path) -> None:
    spec = small_job("target-position", count=(30, 30), px_per_lens=3)
    place = local_place(tmp_path)
    codes = rendered_codes(place, stored_job(place, spec)).astype(np.float64)
    centre = view(orthoscopic(codes, frame_size(spec.rig)), frame_size(spec.rig), 1, 1)
    assert (np.diff(centre[..., 0], axis=1) > 0).all(), "x grows to the right"
    assert (np.diff(centre[..., 1], axis=0) < 0).all(), "y grows upward"


def test_the_centre_view_is_the_picture_of_a_pinhole_at_the_entrance_pupil(tmp_path: Path) -> None:
    """The fish, by an ordinary camera of POV-Ray: alike, and more alike than any flip of it."""
    spec = small_job("fish", count=(90, 90), px_per_lens=3)
    upright = captured(tmp_path, spec)["orthoscopic"]
    centre = luminance(view(upright, frame_size(spec.rig), 1, 1))
    ordinary = luminance(plain_picture(scene_folders()["fish"], tmp_path / "plain.exr"))
    flips = {"upright": centre, "mirrored": centre[:, ::-1], "upside down": centre[::-1], "turned": centre[::-1, ::-1]}
    alike = {name: np.corrcoef(flip.ravel(), ordinary.ravel())[0, 1] for name, flip in flips.items()}
    assert alike["upright"] > 0.8
    assert alike["upright"] > 0.1 + max(likeness for name, likeness in alike.items() if name != "upright")


def plain_picture(scene: Path, picture: Path) -> NDArray[np.float16]:
    """Return what the scene's preview.pov shows; its camera is a pinhole at the entrance pupil."""
    subprocess.run(
        ["povray", "+Ipreview.pov", f"+O{picture}", "+FE", "+W90", "+H90", "-D", "-A", "+WT1", "+K0"],
        cwd=scene,
        check=True,
        capture_output=True,
    )
    return read_rgb(picture, np.float16)
