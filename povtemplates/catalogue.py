"""The folders of the include library, the templates and the scenes."""

from __future__ import annotations

from pathlib import Path

_ROOT = Path(__file__).parent

INCLUDE_FOLDER = _ROOT / "include"
"""It holds the folder `lippmann` alone: it comes before the folders of a bundle on POV-Ray's library path."""

RIGS_FOLDER = _ROOT / "rigs"
SCENES_FOLDER = _ROOT / "scenes"

MANIFEST = "scene.toml"
POSTER = "poster.png"


def scene_folders() -> dict[str, Path]:
    """Return the folders of the built-in scenes, sorted by name."""
    return {folder.name: folder for folder in sorted(SCENES_FOLDER.iterdir()) if (folder / MANIFEST).is_file()}
