"""Where the includes and the scenes lie."""

from __future__ import annotations

from pathlib import Path

_ROOT = Path(__file__).parent

INCLUDE_FOLDER = _ROOT / "include"
RIGS_FOLDER = _ROOT / "rigs"
SCENES_FOLDER = _ROOT / "scenes"

MANIFEST = "scene.toml"
POSTER = "poster.png"


def scene_folders() -> dict[str, Path]:
    """Return the folders of the scenes that come with the project, by name."""
    return {folder.name: folder for folder in sorted(SCENES_FOLDER.iterdir()) if (folder / MANIFEST).is_file()}
