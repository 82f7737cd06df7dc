"""The folders of the include library, the templates and the scenes."""

from __future__ import annotations

import tomllib
from pathlib import Path

_ROOT = Path(__file__).parent

INCLUDE_FOLDER = _ROOT / "include"
"""It holds the folder `lippmann` alone: it comes before the folders of a bundle on POV-Ray's library path."""

RIGS_FOLDER = _ROOT / "rigs"
SCENES_FOLDER = _ROOT / "scenes"

MANIFEST = "scene.toml"
POSTER = "poster.png"

LISTED = (".inc", ".pov")
"""The endings of the scene files whose built-in scenes are offered: those of the engines that workers render with."""


def scene_folders() -> dict[str, Path]:
    """Return the folders of the built-in scenes that are offered, sorted by name."""
    return {name: folder for name, folder in all_scene_folders().items() if _scene_file(folder).endswith(LISTED)}


def all_scene_folders() -> dict[str, Path]:
    """Return the folders of the built-in scenes, sorted by name, with those of an engine that no worker has yet."""
    return {folder.name: folder for folder in sorted(SCENES_FOLDER.iterdir()) if (folder / MANIFEST).is_file()}


def _scene_file(folder: Path) -> str:
    return str(tomllib.loads((folder / MANIFEST).read_text()).get("file", "scene.inc"))
