"""Scenes as Windows and macOS leave them, rendered by POV-Ray: names, byte order marks, folders, places of errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import SceneError
from tests.builders import small_job
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.settings import WorkerSettings
from worker.tasks.local import capture_frame

MARK = "\N{ZERO WIDTH NO-BREAK SPACE}"
UE = "\N{LATIN SMALL LETTER U WITH DIAERESIS}"
HEAD = "#version 3.7; global_settings { assumed_gamma 1 }\n"
GREY = "#declare Mine = rgb 0.5;\n"
STAGE = "[stage]\nlocation = [0, 0, -1000]\nlook_at = [0, 0, 0]\nnear_mm = 1000\nfar_mm = 2000\n"


def grey(folder: Path, files: Mapping[str, str], *, manifest: str = "") -> float:
    """Return the mean of a captured scene."""
    manifest = manifest if manifest.startswith("file") else f'file = "s.pov"\n{manifest}'
    for name, text in ({"scene.toml": f"{manifest}\n{STAGE}"} | dict(files)).items():
        (folder / "bundle" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "bundle" / name).write_bytes(text.encode())
    captured = capture_frame(
        small_job("own", count=(3, 3), px_per_lens=4, capture={"method": "ray_camera"}),
        pack_folder(folder / "bundle"),
        frame=1,
        out=folder / "out",
        on_progress=lambda what, done: None,
        settings=WorkerSettings(data_dir=folder / "data", slots=1, worker_name="test"),
    )
    (picture,) = (path for path in captured.pictures if path.suffix == ".exr" and "orthoscopic" in str(path))
    return float(read_rgb(picture, np.float16).mean())


@pytest.mark.parametrize(
    ("manifest", "files"),
    [
        ("", {"s.pov": f"{MARK}{HEAD}background {{ rgb 0.5 }}"}),
        ("", {"s.pov": f'{MARK}{HEAD}#include "PARTS.INC"\nbackground {{ Mine }}', "Parts.inc": MARK + GREY}),
        (
            "",
            {
                "s.pov": f'{HEAD}#include "Maps\\GREY.inc"\n#include "Colors.inc"\nbackground {{ Mine }}',
                "maps/grey.inc": GREY,
            },
        ),
        (
            'include = ["My models"]',
            {"s.pov": f'{HEAD}#include "g.inc"\nbackground {{ Mine }}', "My models/g.inc": GREY},
        ),
        (
            f'file = "W{UE}rfel (2), alt.pov"\ninclude = ["R&D, 2025"]',
            {
                f"W{UE}rfel (2), alt.pov": f'{HEAD}#include "gr{UE}n.inc"\nbackground {{ Mine }}',
                f"R&D, 2025/Gr{UE}n.inc": GREY,
            },
        ),
    ],
    ids=["byte order mark", "another case", "backslashes and colors.inc", "folder with a blank", "names outside ASCII"],
)
def test_a_scene_of_another_system_is_rendered(tmp_path: Path, manifest: str, files: dict[str, str]) -> None:
    assert grey(tmp_path, files, manifest=manifest) == pytest.approx(0.5, abs=0.001)


@pytest.mark.parametrize(
    ("text", "more", "expected"),
    [
        (
            '#include "grey.inc"',
            {"models/grey.inc": GREY},
            "s.pov line 2: no file .* has 'models/grey.inc': add include",
        ),
        (
            '#include concat("G", "rey.inc")',
            {"grey.inc": GREY},
            "s.pov line 2: no file 'Grey.inc' .* the bundle has 'grey.inc'",
        ),
        ('#include "PARTS.inc"', {"parts.inc": "\n\nsphere { 0 }"}, "parts.inc line 3: "),
        ("union {\n  sphere { 0, 1 }\n", {}, r"s\.pov line 3: .* the end of the file found instead"),
        ("#macro A()\n  sphere { 0, 1 }\n", {}, r"s\.pov line 3: End of file reached but #end expected"),
        ("/* sphere\n", {}, r"s\.pov line \d: No \*/ closing comment found"),
    ],
)
def test_an_error_names_the_place_in_the_scene(tmp_path: Path, text: str, more: dict[str, str], expected: str) -> None:
    with pytest.raises(SceneError, match=expected):
        grey(tmp_path, {"s.pov": HEAD + text} | more)
