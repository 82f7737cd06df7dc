"""Scene bundles from disk: a folder, a zip, or the name of a scene that comes along."""

from __future__ import annotations

from pathlib import Path

from lippmann.errors import BadInput
from povtemplates.catalogue import scene_folders
from worker.sandbox.bundle import check_bundle, pack_folder


def read_bundle(path: Path) -> bytes:
    """Return the zip of a bundle that was looked through.

    Raises
    ------
    BadInput
        If there is none.
    lippmann.errors.BundleError
        If it is not whole: naming the file and field.
    """
    try:
        data = pack_folder(path) if path.is_dir() else path.read_bytes()
    except OSError as error:
        raise BadInput(f"expected a scene bundle, a folder or a zip, got {path}: {error.strerror}") from error
    check_bundle(data)
    return data


def find_bundle(scene: str) -> tuple[str, bytes]:
    """Return the name and bundle of a scene that comes along, or of a folder or zip.

    Raises
    ------
    BadInput
        If there is neither.
    """
    folders = scene_folders()
    if scene in folders:
        return scene, pack_folder(folders[scene])
    path = Path(scene)
    if not path.exists():
        raise BadInput(f"expected a folder, a zip or one of {', '.join(folders)}, got {scene!r}")
    return path.resolve().stem, read_bundle(path)
