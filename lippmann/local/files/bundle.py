"""Scene bundles from disk: a folder, a zip, or the name of a built-in scene."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from lippmann.errors import BadInput
from lippmann.job.rendering.engines import MITSUBA_FILES, POVRAY_FILES
from lippmann.job.scenes.scene import SCENE_FILE
from lippmann.local.scenes.model_init import MODEL_SUFFIXES
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST, scene_folders
from worker.sandbox.bundle import check_bundle, pack_folder

_SCENE_SUFFIXES = (*POVRAY_FILES, *MITSUBA_FILES)


def read_bundle(path: Path) -> bytes:
    """Read and check a scene bundle, and return it as a zip.

    Raises
    ------
    BadInput
        If there is no such folder or zip.
    lippmann.errors.BundleError
        If the bundle is invalid; the message names the file and the field.
    """
    try:
        data = pack_folder(path) if path.is_dir() else path.read_bytes()
    except OSError as error:
        raise BadInput(f"expected a scene bundle, a folder or a zip, got {path}: {error.strerror}") from error
    check_bundle(data)
    return data


def find_bundle(scene: str) -> tuple[str, bytes]:
    """Return the name and the bundle of a built-in scene, or of a folder or zip.

    Raises
    ------
    BadInput
        If there is no such scene, folder or zip.
    """
    folders = scene_folders()
    if scene in folders:
        return scene, pack_folder(folders[scene])
    path = Path(scene)
    if path.suffix.lower() in _SCENE_SUFFIXES and path.is_file():
        path = _folder_of(path)
    if "\0" in scene or not path.exists():
        hint = "".join(f" (did you mean {meant}?)" for meant in get_close_matches(scene[:100], folders, n=1))
        raise BadInput(f"expected a folder, a zip or a scene file, or one of {', '.join(folders)}{hint}, got {scene!r}")
    return path.resolve().stem, read_bundle(path)


def _folder_of(file: Path) -> Path:
    """Return the folder of a scene file, which has to have a scene.toml that names it."""
    manifest = file.parent / MANIFEST
    if not manifest.is_file():
        is_known = file.suffix.lower() in (*POVRAY_FILES, *MODEL_SUFFIXES)
        hint = f"; `lippmann scenes init {file}` writes one from the scene's own camera" if is_known else ""
        raise BadInput(f"expected a {MANIFEST} beside {file}, which places the rig, got none{hint}")
    named = read_toml(manifest.read_bytes(), field=MANIFEST).get("file", SCENE_FILE)
    if named != file.name:
        raise BadInput(f"expected {file.name} as `file` of {manifest}, got {named!r}")
    return file.parent
