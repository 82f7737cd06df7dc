"""Job files and `--set`: JSON as in `lippmann.job.spec`, with single fields set from the command line."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput, InputNote, InvalidText
from lippmann.untrusted.json_text import LIMITS, read_json
from lippmann.untrusted.shown import shown


def read_job(source: str, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Read a job file, or stdin if `source` is `-`, and set some of its fields.

    Parameters
    ----------
    source
        The path of the file.
    overrides
        The fields to set, each as `field=value`.

    Raises
    ------
    BadInput
        If it cannot be read or is no JSON object, or an override is invalid.
    """
    job = _parse(_read(source), source)
    for override in overrides:
        set_field(job, override)
    take_in_lens(job, Path() if source == "-" else Path(source).parent)
    return job


def take_in_lens(job: dict[str, Any], folder: Path) -> None:
    """Replace the name of a lens file beside the job, `{"file": "my-lens.zmx"}`, by the prescription in it.

    Glass catalogues may be named with it, `{"file": "my-lens.zmx", "catalogues": ["my.agf"]}`. What a user should know
    of the file is an `InputNote`.

    Parameters
    ----------
    job
        The data of the job, which is changed.
    folder
        The folder of the job file.

    Raises
    ------
    BadInput, SpecError
        If the file cannot be read, or is no prescription.
    """
    rig = job.get("rig")
    lens = rig.get("imaging_lens") if isinstance(rig, dict) else None
    if not (
        isinstance(rig, dict) and isinstance(lens, dict) and "file" in lens and set(lens) <= {"file", "catalogues"}
    ):
        return
    from lippmann.local.files.lens import read_lens

    catalogues = lens.get("catalogues", [])
    if not isinstance(catalogues, list) or not all(isinstance(name, str) for name in catalogues):
        raise BadInput(
            f"rig.imaging_lens.catalogues: expected a list of .agf files, got {json.dumps(catalogues)[:100]}"
        )
    file = read_lens(folder / str(lens["file"]), [folder / name for name in catalogues])
    for note in file.notes:
        warnings.warn(f"{lens['file']}: {note}", InputNote, stacklevel=2)
    rig["imaging_lens"] = file.prescription.model_dump(mode="json", exclude_defaults=True)


def set_field(job: dict[str, Any], override: str) -> None:
    """Set one field of a job, `path=value`; a value that is no JSON is text.

    Parameters
    ----------
    job
        The data of the job, which is changed.
    override
        The field and its value.

    Examples
    --------
    >>> job = {"scene": "fish"}
    >>> set_field(job, "rig.lens_array.count=[4, 5]"); set_field(job, "frames=1-3"); job
    {'scene': 'fish', 'rig': {'lens_array': {'count': [4, 5]}}, 'frames': '1-3'}
    """
    path, equals, text = override.partition("=")
    *above, last = path.strip().split(".")
    if not equals or not last or not all(above) or len(above) > LIMITS.depth:
        raise BadInput(f"--set: expected field=value as in rig.px_per_lens=4, got {override!r}")
    place = job
    for name in above:
        place = place.setdefault(name, {})
        if not isinstance(place, dict):
            raise BadInput(f"--set {path}: expected a field below {name!r}, got {name}={json.dumps(place)}")
    place[last] = _value(path.strip(), text)


def _value(path: str, text: str) -> Any:
    if path in ("frames", "scene", "title"):  # text by nature: the job `frames=5` means "5"
        return text.strip()
    try:
        return read_json(text, field=path)
    except InvalidText:
        return text.strip()


def _read(source: str) -> bytes:
    try:
        if source == "-":
            return sys.stdin.buffer.read(LIMITS.size_bytes + 1)
        with Path(source).open("rb") as file:
            return file.read(LIMITS.size_bytes + 1)
    except OSError as error:
        raise BadInput(f"expected a job file, got {source}: {error.strerror}") from error


def _parse(data: bytes, source: str) -> dict[str, Any]:
    where = "stdin" if source == "-" else source
    job = read_json(data, field=where)
    if not isinstance(job, dict):
        raise BadInput(f"{where}: expected a job as a JSON object, got {shown(job)}")
    return job
