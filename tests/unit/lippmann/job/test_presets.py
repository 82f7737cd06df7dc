"""The presets: each is a valid job, and its design gives what its description says."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.job.outputs.datasets import HciFolder
from lippmann.job.outputs.pictures import Quilt
from lippmann.job.outputs.prints import PAPERS_MM, Print
from lippmann.job.presets import PRESETS
from lippmann.job.spec import parse_spec
from lippmann.local.design import design


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_a_valid_job_of_a_scene_that_comes_along(name: str) -> None:
    preset = PRESETS[name]
    assert design(preset=name).frames == len(parse_spec(preset.job).frame_numbers)
    assert preset.description.endswith(".")


def test_the_paper_s_presets_have_the_paper_s_pixels() -> None:
    still, video = design(preset="paper-still"), design(preset="paper-iv")
    assert (still.device_rows_px, still.device_cols_px) == (2400, 2400)
    assert (video.frames, video.views, video.view_cols_px) == (45, 64, 90)


def test_the_print_is_sharp_at_600_dpi_and_fits_on_its_page() -> None:
    found = design(preset="print-600")
    assert (found.device_cells_px, found.depth_budget) == ((23, 24), "fits")
    page = next(one for one in parse_spec(PRESETS["print-600"].job).outputs if isinstance(one, Print))
    assert page.page == "a4"
    assert page.paper_mm(found.width_mm, found.height_mm) == PAPERS_MM["a4"]


def test_the_panel_is_sharp_through_the_whole_scene_from_a_metre() -> None:
    found = design(preset="panel-203")
    assert (found.depth_budget, found.viewing_distance_mm) == ("fits", 1000.0)
    assert found.display_pixel_mm == pytest.approx(25.4 / 203)


def test_the_quilt_has_the_tiles_of_a_looking_glass_portrait() -> None:
    found = design(preset="looking-glass")
    (quilt,) = parse_spec(PRESETS["looking-glass"].job).outputs
    assert isinstance(quilt, Quilt)
    assert quilt.count is not None
    assert (quilt.tile_columns(quilt.count), quilt.count // quilt.tile_columns(quilt.count)) == (8, 6)
    assert (found.view_cols_px * quilt.scale, found.view_rows_px * quilt.scale) == (420, 560)
    assert found.view_cols_px / found.view_rows_px == quilt.aspect
    assert found.px_per_lens == 16


def test_the_light_field_has_the_views_and_the_disparity_of_the_benchmark() -> None:
    found = design(preset="hci")
    spec = parse_spec(PRESETS["hci"].job)
    (folder,) = spec.outputs
    assert isinstance(folder, HciFolder)
    assert (folder.views, found.view_cols_px, found.view_rows_px) == ((9, 9), 512, 512)
    assert (spec.capture.depth, folder.disparity) == (True, "truth")
    # The scenes of the benchmark have disparities of about -3.5 to 3.5 px between neighbouring views.
    assert found.exact_disparity_near is not None
    assert found.exact_disparity_far is not None
    assert max(abs(found.exact_disparity_near), abs(found.exact_disparity_far)) < 3.5


def test_every_preset_is_named_in_the_page_of_the_command() -> None:
    page = (Path(__file__).parents[4] / "docs" / "command.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in PRESETS)
