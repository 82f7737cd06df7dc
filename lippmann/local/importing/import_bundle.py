"""Write pictures and their lenses as a bundle, for a job that renders nothing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lippmann.local.files.source_pictures import Decoding, SourcePicture
from lippmann.local.files.writable import check_writable
from lippmann.local.importing.import_sheets import Lenses


def write_bundle(
    pictures: Sequence[SourcePicture],
    lenses: Lenses,
    folder: Path,
    *,
    title: str,
    decoding: Decoding | None = None,
    white: Path | None = None,
) -> None:
    """Write pictures and their geometry as a bundle.

    Parameters
    ----------
    pictures
        The pictures, in the order of the frames.
    lenses
        The lenses over every picture.
    folder
        The folder to write.
    title
        The title of the scene.
    decoding
        How the numbers of the pictures become light; by default as their files say.
    white
        The white image by which the pictures are divided.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    check_writable(folder)
    (folder / "frames").mkdir(exist_ok=True)
    # The frames are listed, so that files of an earlier import are not taken for frames.
    stored = _copied([picture.path for picture in pictures], folder)
    listed = [f"{stored[picture.path]}{picture.page_mark}" for picture in pictures]
    decoding = decoding or Decoding()
    data: dict[str, Any] = {"files": listed, **geometry_data(lenses)}
    if decoding.linear:
        data["linear"] = True
    if decoding.white_level is not None:
        data["white_level"] = decoding.white_level
    if white is not None:
        data["white"] = f"white{white.suffix.lower()}"
        shutil.copyfile(white, folder / data["white"])
    # Numbers, texts, lists and booleans are written in TOML as in JSON.
    lines = (f"{name} = {json.dumps(value)}" for name, value in data.items())
    text = (f"title = {json.dumps(title)}", "", "[sheets]", *lines, "")
    (folder / "scene.toml").write_text("\n".join(text))


def geometry_data(lenses: Lenses) -> dict[str, Any]:
    """Return the lenses as `--json` and a bundle name them, with every number in full: a job gives the same pixels."""
    grid, geometry = lenses.grid, lenses.geometry
    return {
        "pitch_px": grid.pitch_px,
        "lattice": grid.lattice,
        "row_pitch_px": grid.row_px,
        "rotation_deg": grid.turn_deg,
        "offset_px": list(grid.offset_px),
        "count": [grid.lens_rows, grid.lens_cols],
        "first_row_shifted": grid.first_row_shifted,
        "px_per_lens": lenses.rig.px_per_lens,
        "pseudoscopic": geometry.pseudoscopic,
        "inverted": geometry.inverted,
        "pitch_mm": lenses.rig.lens_array.pitch_mm,
        "focal_length_mm": lenses.rig.lens_array.focal_length_mm,
    }


def _copied(paths: Sequence[Path], folder: Path) -> dict[Path, str]:
    """Copy every file once; return the names in the bundle, by path."""
    stored: dict[Path, str] = {}
    for path in paths:
        if path not in stored:
            stored[path] = f"frames/{len(stored) + 1:04d}{path.suffix.lower()}"
            shutil.copyfile(path, folder / stored[path])
    return stored
