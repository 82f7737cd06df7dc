"""Masters written for tests, and commands run on them in this process."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from lippmann.cli import main
from lippmann.job.optics.rig import Rig
from lippmann.plan.sampling import display_size
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot
from worker.images.write import write_exr

COUNT = (21, 20)


def rig_of(lattice: str = "square") -> Rig:
    return Rig.model_validate({"px_per_lens": 8, "lens_array": {"count": COUNT, "lattice": lattice}})


def master_of(folder: Path, rig: Rig, *, said: str | None = None) -> Path:
    """Write a master of a point 20 mm in front of the display."""
    light = sheet_of_texture(display_size(rig), spot, 20.0, focal_mm=rig.lens_array.focal_length_mm)
    path = folder / "orthoscopic" / "0001.exr"
    path.parent.mkdir(parents=True)
    write_exr(path, light.repeat(3, axis=2), attributes={"rig": said or rig.model_dump_json()})
    return path


def said_by(*arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    monkeypatch.setattr(sys, "argv", ["lippmann", *arguments, "--json"])
    with pytest.raises(SystemExit) as ended:
        main.main()
    said = capsys.readouterr()
    assert not ended.value.code, said.err
    return json.loads(said.out)
