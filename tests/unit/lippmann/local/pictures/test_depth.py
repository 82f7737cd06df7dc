"""`lippmann depth`: the estimate, its errors where the truth lies beside the master, and the truth itself."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.cli import main
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.plan.sampling import display_size
from tests.pictures import read_png
from tests.unit.lippmann.local.masters import master_of, rig_of
from worker.images.read import read_channels
from worker.images.write import write_channels


def run(*arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    monkeypatch.setattr(sys, "argv", ["lippmann", "depth", *arguments])
    with pytest.raises(SystemExit) as ended:
        main.main()
    said = capsys.readouterr()
    return int(ended.value.code or 0), said.out, said.err


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    return lambda *arguments: run(*arguments, monkeypatch=monkeypatch, capsys=capsys)


def with_truth(folder: Path, lattice: str) -> Path:
    """Write a master of a spot 20 mm in front of the display, and a depth of 20 mm wherever it is bright."""
    rig = rig_of(lattice)
    master, layout = master_of(folder, rig), display_size(rig)
    values = np.full((layout.rows, layout.cols, 4), [1000.0, 20.0, 20 / 26.4, 20 / 26.4], dtype=np.float32)
    (folder / "depth").mkdir()
    size = values.shape[:2]
    write_channels(folder / "depth" / "0001.exr", (values,), CHANNELS, size=size, attributes={})
    return master


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_an_estimate_is_compared_with_the_truth_beside_the_master(ask: Any, tmp_path: Path, lattice: str) -> None:
    master = with_truth(tmp_path, lattice)
    code, out, err = ask(str(master), "--out", str(tmp_path / "d.exr"), "--range=0:40", "--border", "8", "--json")
    assert code == 0, err
    said = json.loads(out)
    assert said["source"] == "estimate"
    found = read_channels(tmp_path / "d.exr", ("s_mm", "disparity", "confidence"))
    rows, cols = found.shape[:2]
    inner = found[8:-8, 8:-8]
    assert inner[..., 0] == pytest.approx(20.0, abs=1.5), "about the spot"
    errors = said["errors"]
    off = np.abs(inner[..., 1] - np.float32(20 / 26.4))
    assert errors["pixels"] == (rows - 16) * (cols - 16)
    assert errors["badpix_percent"]["0.03"] == pytest.approx((off > 0.03).mean() * 100)
    assert errors["mse_x100"] == pytest.approx((off.astype(float) ** 2).mean() * 100, rel=1e-4)
    assert ask(str(master), "--out", str(tmp_path / "d.png"))[1].count("BadPix") == 1


def test_the_truth_is_shown_in_colours(ask: Any, tmp_path: Path) -> None:
    master = with_truth(tmp_path, "square")
    code, out, err = ask(str(master), "--truth", "--out", str(tmp_path / "t.png"), "--json")
    assert code == 0, err
    assert json.loads(out)["errors"] is None
    codes = read_png(tmp_path / "t.png")
    assert (codes == codes[0, 0]).all()
    assert codes[0, 0, 0] > codes[0, 0, 2]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--truth", "--out", "d.png"], "expected the depth of a job with capture.depth"),
        (["--out", "d.jpg"], "expected .png, .exr, .pfm in --out"),
        (["--out", "d.png", "--u", "3"], "expected --u and --v"),
        (["--out", "d.png", "--u", "8", "--v", "0"], "view"),
        (["--out", "d.png", "--range", "5:2"], "expected depths as FARTHEST:NEAREST"),
        (["--out", "d.png", "--range", "five"], "expected depths as A:B in mm"),
    ],
)
def test_what_cannot_be_is_named(ask: Any, tmp_path: Path, arguments: list[str], expected: str) -> None:
    master = master_of(tmp_path, rig_of())
    asked = [str(tmp_path / word) if word.startswith("d.") else word for word in arguments]
    code, _, err = ask(str(master), *asked)
    assert code == 2
    assert expected in err
