"""The scene of a job at a frame, by the kind of its scene file."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from lippmann.errors import SceneError
from lippmann.job.rendering.engines import MITSUBA_FILES
from lippmann.job.resolved import ResolvedJob
from worker.engines.mitsuba.inside.scenes.loaded import LoadedScene, SceneFiles

_TEXT_PLACE = re.compile(r"\A[A-Za-z ]*\(line \d+, col \d+\): ")
"""The place in the text that the loader of XML writes, which is not that in the file."""


def load(bundle: Path, job: ResolvedJob, clock: float) -> LoadedScene:
    """Load the scene of a job; a variant of Mitsuba is set before.

    Parameters
    ----------
    bundle
        The folder with the files of the bundle.
    job
        The job at the frame.
    clock
        The clock at the frame; the time in seconds for a glTF file.

    Raises
    ------
    SceneError
        If a file is damaged, beyond a limit, missing or outside the bundle; the message names the place.
    """
    files = SceneFiles(bundle.resolve(), job, clock)
    try:
        scene = _scene(files)
    except RuntimeError as error:  # Mitsuba's own word for whatever it cannot make of a scene.
        raise SceneError(f"{job.file}: {_words(error, files)}") from error
    box = scene.bbox()
    corners = np.array([box.min, box.max], dtype=np.float64).ravel()
    if scene.shapes() and not (np.isfinite(corners).all() and np.abs(corners).max() < 1e15):
        raise files.refuse(job.file, "shapes of a finite size", "a box that is not finite")
    return LoadedScene(scene=scene, notes=tuple(files.notes), reads=frozenset(files.reads), names=files.names)


def _scene(files: SceneFiles) -> Any:
    """Return the `mi.Scene` of a file. A loader and its libraries are imported for their kind of file alone."""
    suffix = PurePosixPath(files.name).suffix.lower()
    if suffix == ".xml":
        from worker.engines.mitsuba.inside.scenes.xml import load_xml

        return load_xml(files)
    if suffix in (".gltf", ".glb"):
        from worker.engines.mitsuba.inside.scenes.gltf import load_gltf

        return load_gltf(files)
    from worker.engines.mitsuba.inside.scenes.splats import is_splats, load_splats

    path = files.path(files.name, beside="", place="file")
    if is_splats(path):
        return load_splats(path, files.note)
    if suffix not in (".obj", ".ply"):
        raise files.refuse("file", f"a scene file that ends with {', '.join(MITSUBA_FILES)}", files.name)
    from worker.engines.mitsuba.inside.scenes.meshes import load_mesh

    return load_mesh(files)


def _words(error: RuntimeError, files: SceneFiles) -> str:
    """Return what Mitsuba says, without the places of our own folders and of its source."""
    text = str(error).replace(f"{files.bundle}/", "").strip()
    return _TEXT_PLACE.sub("", text.partition("] ")[2] if text.startswith("[") and "] " in text else text)
