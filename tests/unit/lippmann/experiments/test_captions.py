"""Signs of depth against the captions of Fig. 7."""

from __future__ import annotations

import re

import pytest

from lippmann.experiments.figures.captions import CAPTIONS, Agreement, Depth, agreement, mean_mm
from lippmann.experiments.settings import POSITIONS_MM, sweep
from tests.repository import DOCS


def depths(*measured_mm: float) -> list[Depth]:
    return [Depth("x", 0.0, 0.0, each, 1.0) for each in measured_mm]


CASES = [
    ("a", (58, 30, 16, 9, 3), "yes"),
    ("a", (58, 30, 16, 9, -3), "as a group"),
    ("a", (-1, 30, 16, 9, 3), "no"),
    ("b", (38, 10, -4, -12, -18), "as a group"),
    ("b", (38, 10, 4, 2, -6), "no"),
    ("b", (38, -1, -4, -12, -18), "yes"),
    ("b", (-38, -10, -4, -12, -18), "no"),
    ("c", (7, -21, -35, -42, -48), "yes"),
    ("c", (7, 1, -35, -42, -48), "as a group"),
    ("c", (-7, -21, -35, -42, -48), "no"),
    ("d", (-13, -41, -55, -63, -69), "yes"),
    ("d", (1, -41, -55, -63, -69), "no"),
]


@pytest.mark.parametrize(("letter", "measured", "expected"), CASES)
def test_a_caption_agrees_with_depths_on_its_sides_of_the_array(
    letter: str, measured: tuple[float, ...], expected: Agreement
) -> None:
    caption = next(each for each in CAPTIONS if each.letter == letter)
    assert agreement(caption, depths(*measured)) == expected


def test_the_page_has_the_verdicts_that_follow_from_its_own_depths() -> None:
    page = (DOCS / "paper.md").read_text("utf-8")
    depth = r" [-+][\d.]+ \([^)]+\) \|"
    rows = re.findall(rf"^\| \(([a-d])\) [^|]+\|((?:{depth}){{5}})[^|]+\| ([a-z ]+) \|$", page, re.MULTILINE)
    assert [letter for letter, _, _ in rows] == 2 * ["a", "b", "c", "d"], "with both cameras"
    for letter, cells, verdict in rows:
        caption = next(each for each in CAPTIONS if each.letter == letter)
        measured = [float(cell.split()[0]) for cell in cells.strip("|").split("|")]
        assert agreement(caption, depths(*measured)) == verdict


def test_the_mean_of_depths_is_their_mean() -> None:
    assert mean_mm(depths(10, -4, -12, -18)) == -6


def test_the_four_positions_are_one_job_in_which_only_the_array_moves() -> None:
    spec = sweep(px_per_lens=None)
    frames = [spec.at(frame) for frame in spec.frame_numbers]
    assert tuple(frame.rig.lens_array.offset_mm for frame in frames) == POSITIONS_MM
    assert spec.rig.px_per_lens == 24
    assert spec.rig.device is not None
    assert (spec.rig.device.dpi, spec.rig.device.window_px) == (600, (2400, 2400))
    first, *others = (frame.model_dump(exclude={"rig": {"lens_array": {"offset_mm"}}}) for frame in frames)
    assert all(other == first for other in others)
    assert spec.clock is not None
    assert {spec.clock.at(frame) for frame in spec.frame_numbers} == {0.0}


def test_the_pinhole_camera_is_the_papers_and_the_only_difference() -> None:
    ours, papers = sweep(px_per_lens=6), sweep(px_per_lens=6, camera="pinhole")
    assert (ours.rig.camera.projection, papers.rig.camera.projection) == ("orthographic", "perspective")
    assert papers.rig.camera.angle_deg == pytest.approx(67.38 / 10)
    without_camera = {"rig": {"camera"}}
    assert papers.model_dump(exclude=without_camera) == ours.model_dump(exclude=without_camera)
