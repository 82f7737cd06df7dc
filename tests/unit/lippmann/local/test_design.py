"""`lippmann design`: from a preset, a job file or a scene to numbers, text and a drawing."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from lippmann.cli import main
from lippmann.cli.text.design import design_text
from lippmann.errors import BadInput, SpecError
from lippmann.local.design import design, design_sheet
from lippmann.plan.design import designer
from tests.repository import DOCS

NUMBER = re.compile(r"(?<![\w.#])(-?\d+\.?\d*)")


def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    monkeypatch.setattr(sys, "argv", ["lippmann", "design", *arguments])
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert not ended.value.code
    return capsys.readouterr().out


def found(job_file: str | None = None, *overrides: str, preset: str | None = None, **more: Any) -> Any:
    return design(job_file, overrides=overrides, preset=preset, **more)


def test_json_is_flat_and_carries_units(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    data = json.loads(run(monkeypatch, capsys, "--preset", "paper-still", "--json"))
    assert data["efl_mm"] == pytest.approx(300.46784621322, rel=1e-12)
    assert data["gap_real_mm"] == pytest.approx(3.71477, abs=5.1e-6)
    nested = {key for key, value in data.items() if isinstance(value, dict)}
    assert nested == {"conjugates"}


def test_text_says_every_part_in_words(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    text = run(monkeypatch, capsys, "--preset", "paper-still")
    for words in (
        "Imaging lens",
        "300.4678 mm",
        "177.995223",
        "mixed: ",
        "cells of 23 and 24",
        "depth budget  ",
        "fits.",
    ):
        assert words in text


def test_the_numbers_of_the_page_are_those_of_the_command() -> None:
    page = (DOCS / "designer.md").read_text("utf-8")
    (block,) = re.findall(r"^    Imaging lens\n(?:    .*\n)+", page, re.MULTILINE)
    printed = [" ".join(line.split()) for line in design_text(found(preset="paper-still")).splitlines()]
    for line in block.splitlines():
        assert " ".join(line.split()) in [*printed, "..."]


@pytest.mark.parametrize(
    "overrides",
    [
        ("rig.imaging_lens=null", "rig.lens_array.offset_mm=-20"),
        ("rig.lens_array.lattice=hexagonal",),
        ("rig.device=null", "rig.px_per_lens=2", "rig.lens_array.count=[1, 1]"),
        ("stage.near_mm=50",),
        ("rig.f_number=22", "rig.lens_array.offset_mm=60"),
    ],
)
def test_any_design_has_a_text(overrides: tuple[str, ...]) -> None:
    text = design_text(found(None, *overrides, preset="paper-still"))
    assert "nan" not in text
    assert "None" not in text


def test_a_drawing_is_written_to_a_new_folder_and_refused_below_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "bench.svg"
    run(monkeypatch, capsys, "--preset", "paper-iv", "--svg", str(out))
    assert out.is_file()
    monkeypatch.setattr(sys, "argv", ["lippmann", "design", "--preset", "paper-iv", "--svg", str(out / "bench.svg")])
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code
    assert "expected a folder that can be written" in capsys.readouterr().err


def test_the_drawing_is_written_where_it_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "bench.svg"
    run(monkeypatch, capsys, "--preset", "paper-iv", "--svg", str(out), "--json")
    assert ET.parse(out).getroot()[0].text == "Athineos 2006, integral video"


def test_a_job_file_goes_with_its_scene_and_another_scene_goes_before_it(tmp_path: Path) -> None:
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"scene": "fish", "rig": {"px_per_lens": 4}}))
    assert found(str(job)).scene == "fish"
    other = found(str(job), "rig.px_per_lens=6", scene="target-white")
    assert (other.scene, other.px_per_lens) == ("target-white", 6)
    assert found(scene="fish").px_per_lens == 8


def test_presets_are_not_changed_by_what_is_set() -> None:
    changed = found(None, "rig.lens_array.offset_mm=10", preset="paper-still")
    again = found(preset="paper-still")
    assert (changed.s_reference_mm, again.s_reference_mm) == pytest.approx((10.0, 40.0))


@pytest.mark.parametrize(
    ("job_file", "preset", "said"),
    [
        (None, None, "got none of them"),
        ("job.json", "paper-iv", "got both"),
        (None, "paper-x", "one of paper-still, paper-iv"),
    ],
)
def test_what_cannot_be_asked_for_is_said(job_file: str | None, preset: str | None, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        found(job_file, preset=preset)


def test_the_drawing_in_the_docs_is_the_one_that_its_command_makes() -> None:
    shown = DOCS / "images" / "bench.svg"
    drawing = designer.drawing(design_sheet(None, preset="paper-still", scene=None, overrides=()))
    kept, made = (NUMBER.split(text) for text in (shown.read_text(encoding="utf-8").strip(), drawing))
    assert kept[::2] == made[::2], "run the command of docs/designer.md, and look at it"
    # The last digit may be rounded otherwise on another machine.
    assert list(map(float, kept[1::2])) == pytest.approx(list(map(float, made[1::2])), abs=0.011)


@pytest.mark.parametrize("of_design", [designer.design, designer.drawing])
def test_imported_integral_images_have_no_design(tmp_path: Path, of_design: Callable[..., Any]) -> None:
    (tmp_path / "sheet.png").touch()
    manifest = '[sheets]\nfiles = ["sheet.png"]\npitch_px = 6\ncount = [8, 8]\npx_per_lens = 6\n'
    (tmp_path / "scene.toml").write_text(manifest)
    with pytest.raises(SpecError, match="a bundle of imported integral images, which has no design"):
        of_design(design_sheet(None, preset=None, scene=str(tmp_path), overrides=()))
