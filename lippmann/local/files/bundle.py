"""Scene bundles from disk: a folder, a zip, or the name of an included scene."""

from __future__ import annotations

from pathlib import Path

from lippmann.errors import BadInput
from povtemplates.catalogue import scene_folders
from worker.sandbox.bundle import check_bundle, pack_folder


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
    """Return the name and the bundle of an included scene, or of a folder or zip.

    Raises
    ------
    BadInput
        If there is no such scene, folder or zip.
    """
    folders = scene_folders()
    if scene in folders:
        return scene, pack_folder(folders[scene])
    path = Path(scene)
    if not path.exists():
        raise BadInput(f"expected a folder, a zip or one of {', '.join(folders)}, got {scene!r}")
    return path.resolve().stem, read_bundle(path)
