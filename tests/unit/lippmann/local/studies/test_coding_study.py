"""A coding study: what it measures, of masters that are given."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import BadInput
from lippmann.lattice.layout import CellLayout
from lippmann.local.studies.codec_rates import Sequence8, study
from lippmann.local.studies.coding_study import StudyOptions, run_study
from lippmann.plan.sampling import display_size
from tests.builders import small_job
from worker.images.read import read_attributes
from worker.images.write import write_exr

OPTIONS = StudyOptions(
    codecs=("x264", "vp9"), arrangements=("sheets", "views"), qps=(10, 40), chroma="4:4:4", intra=False
)


def masters(folder: Path, frames: int = 2, **lens_array: str) -> CellLayout:
    """Write masters whose views show a wave with a parallax of a lens a view."""
    rig = small_job("target-white", count=(16, 18), px_per_lens=4, lens_array=lens_array).rig
    layout = display_size(rig)
    row, col = np.mgrid[0 : layout.rows, 0 : layout.cols]
    u, lens = 3 - col % 4, col // 4
    for frame in range(1, frames + 1):
        wave = 0.3 + 0.2 * np.sin((lens + u + frame) / 3)
        light = np.stack([wave, 0.1 + 0.2 * row / layout.rows, 0.5 - wave / 2], axis=-1)
        (folder / "orthoscopic").mkdir(parents=True, exist_ok=True)
        write_exr(folder / f"orthoscopic/{frame:04d}.exr", light, attributes={"rig": rig.model_dump_json()})
    return layout


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_every_codec_arrangement_and_quantizer_is_measured_and_written_down(tmp_path: Path, lattice: str) -> None:
    layout = masters(tmp_path / "job", lattice=lattice)
    studied = run_study(tmp_path / "job", OPTIONS, fps=8.0, out=tmp_path / "out")
    assert (studied.frames, studied.layout, len(studied.points)) == (2, layout, 8)
    table, data, plot = studied.files
    with table.open() as file:
        assert [row["codec"] for row in csv.DictReader(file)] == ["x264"] * 4 + ["vp9"] * 4
    assert len(json.loads(data.read_text())["points"]) == 8
    assert plot.read_bytes().startswith(b"\x89PNG")
    for point in studied.points:
        assert point.bits_per_px == pytest.approx(point.bits / (layout.px * 2))
        assert point.kbit_s == pytest.approx(point.bits / 2 * 8.0 / 1000)
    fine, coarse = (studied.points[place] for place in (0, 1))
    assert fine.bits > coarse.bits
    assert fine.view_psnr_y_db > coarse.view_psnr_y_db >= coarse.view_psnr_y_min_db


def test_arranged_as_views_a_picture_in_the_plane_of_the_display_costs_less(tmp_path: Path) -> None:
    """All its views are the same: noise that is new from lens to lens, and not from view to view."""
    layout = masters(tmp_path, frames=1)
    noise = np.random.default_rng(1).random((layout.lens_rows, layout.lens_cols, 3))
    attributes = read_attributes(tmp_path / "orthoscopic/0001.exr")
    write_exr(tmp_path / "orthoscopic/0001.exr", noise.repeat(4, axis=0).repeat(4, axis=1), attributes=attributes)
    studied = run_study(tmp_path, OPTIONS, fps=8.0, out=tmp_path / "out")
    bits = {(point.codec, point.arrangement, point.qp): point.bits for point in studied.points}
    assert bits["x264", "views", 10] < bits["x264", "sheets", 10]
    assert studied.bd_rates["x264", "sheets"] == pytest.approx(0, abs=1e-12)
    assert studied.bd_rates["x264", "views"] < 0


def test_a_codec_that_changes_nothing_shows_that_sheets_come_back_from_their_views() -> None:
    """VP9 at quantizer 0 in 4:4:4 keeps what BT.709 codes keep: 8-bit rounding, and nothing of another view."""
    layout = CellLayout(lens_rows=16, lens_cols=18, px_per_lens=4)
    noise = np.random.default_rng(1).integers(0, 256, (2, layout.rows, layout.cols, 3), dtype=np.uint8)
    video = Sequence8(frames=lambda: iter(noise), count=2, layout=layout, fps=8.0)
    points = study(
        video, codecs=("vp9",), arrangements=("sheets", "views"), qps=(0,), chroma="4:4:4", intra=False,
        on_progress=lambda part, what: None,
    )  # fmt: skip
    sheets, views = points
    assert sheets.psnr_y_db > 48
    assert views.psnr_y_db == pytest.approx(sheets.psnr_y_db, abs=0.1)


def test_bad_input_is_named(tmp_path: Path) -> None:
    masters(tmp_path / "job", frames=1)
    with pytest.raises(BadInput, match="expected of h264 a qp from 0 to 51, got 60"):
        run_study(tmp_path / "job", StudyOptions(("x264",), ("sheets",), (60,), "4:2:0", False), fps=8.0, out=tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match="expected frames as EXR or PNG"):
        run_study(tmp_path / "empty", OPTIONS, fps=8.0, out=tmp_path)
    whole = (tmp_path / "job/orthoscopic/0001.exr").read_bytes()
    (tmp_path / "job/orthoscopic/0001.exr").write_bytes(whole[: len(whole) - 2000])
    with pytest.raises(BadInput, match=r"expected a whole picture at .*0001\.exr"):
        run_study(tmp_path / "job", OPTIONS, fps=8.0, out=tmp_path)
