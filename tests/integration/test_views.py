"""Views and refocused pictures of a real capture, by the commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from lippmann.job.optics.rig import Rig
from lippmann.lightfield.refocus.all_in_focus import sharpness
from lippmann.lightfield.views.views import view_of_grid
from lippmann.plan.sampling import display_size
from tests.integration.lippmann.conftest import run
from tests.needs import needs_povray
from worker.images.read import read_rgb
from worker.images.write import write_png

pytestmark = needs_povray

FISH_MM = 37.7 + 3.3
"""On the display: where the exact trace has the flank of the fish (docs/paper.md), and one focal length nearer."""


def test_view_and_refocus_of_a_captured_fish(tmp_path: Path) -> None:
    rig = {"px_per_lens": 8, "lens_array": {"count": [48, 48]}}
    (tmp_path / "job.json").write_text(json.dumps({"scene": "fish", "rig": rig}))
    captured = run("capture", "--job", str(tmp_path / "job.json"), "--out", str(tmp_path))
    assert captured.returncode == 0, captured.stderr
    master = str(tmp_path / "orthoscopic" / "0001.exr")

    seen = run("view", master, "--u", "1", "--v", "6", "--out", str(tmp_path / "view.png"), "--json")
    assert seen.returncode == 0, seen.stderr
    assert json.loads(seen.stdout)["dark_lenses"] == 0
    grid = read_rgb(tmp_path / "views" / "0001.exr", np.float32)
    write_png(tmp_path / "expected.png", view_of_grid(grid, display_size(Rig.model_validate(rig)), 1, 6))
    assert (tmp_path / "view.png").read_bytes() == (tmp_path / "expected.png").read_bytes()

    stack = run("refocus", master, "--stack", "-10:60:5", "--out", str(tmp_path / "stack"), "--json")
    assert stack.returncode == 0, stack.stderr
    said = json.loads(stack.stdout)
    middle = (slice(12, 36), slice(12, 36))
    contrast = [sharpness(read_rgb(Path(file), np.float32)[middle], smooth_px=0).sum() for file in said["files"]]
    assert abs(said["depths_mm"][int(np.argmax(contrast))] - FISH_MM) <= 5.0
