"""The manifest of a backup: what it holds, with counts and digests. It is written last."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lippmann.errors import BadInput
from lippmann.job.fields.problem_words import first_problem

MANIFEST = "manifest.json"
DIGEST = "manifest.json.sha256"
"""The file with the digest of the manifest, in the form of `sha256sum`."""
DATABASE = "database"
ARTIFACTS = "artifacts"
ARTIFACT_LIST = "artifacts.jsonl.gz"
MAX_MANIFEST_BYTES = 1 << 20
VERSION = 1
"""The version of the format. A backup of another version is refused."""

_FROZEN = ConfigDict(frozen=True, extra="forbid")


class BackupBroken(BadInput):
    """The backup is truncated or was altered."""

    code = "backup-broken"


class Lines(BaseModel):
    """A file of compressed JSON lines."""

    model_config = _FROZEN

    lines: int = Field(ge=0)
    size: int = Field(ge=0)
    """The size of the text in bytes, which bounds what a reader decompresses."""
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    """The digest of the compressed file."""


class ArtifactPart(BaseModel):
    """The artifacts of a backup."""

    model_config = _FROZEN

    list: Lines
    """The file with name, size and digest of every artifact."""
    count: int = Field(ge=0)
    bytes: int = Field(ge=0)


class Manifest(BaseModel):
    """The content of a backup."""

    model_config = _FROZEN

    format: Literal["lippmann-backup"] = "lippmann-backup"
    version: int = VERSION
    created_s: float
    """Seconds since 1970, UTC, at which the snapshot of the database was taken."""
    lippmann: str
    """The version of the package that wrote the backup."""
    dialect: str
    """The kind of the database that was backed up; the backup can be restored into any kind."""
    revision: str
    """The schema revision of the database."""
    tables: dict[str, Lines]
    artifacts: ArtifactPart | None
    """None if the backup holds no artifacts."""


def write_manifest(backup: Path, manifest: Manifest) -> None:
    """Write the manifest of a backup, and its digest."""
    text = manifest.model_dump_json(indent=2) + "\n"
    (backup / MANIFEST).write_text(text)
    (backup / DIGEST).write_text(_signature(text.encode()))


def read_manifest(backup: Path) -> Manifest:
    """Return the manifest of a backup.

    Raises
    ------
    BadInput
        If the folder is no backup, or one of another version.
    BackupBroken
        If the manifest cannot be read.
    """
    path = backup / MANIFEST
    if not path.is_file() or path.is_symlink():
        raise BadInput(f"expected a folder that `lippmann backup` wrote, got {backup}, which has no {MANIFEST}")
    if path.stat().st_size > MAX_MANIFEST_BYTES:
        raise BackupBroken(f"{path}: expected at most {MAX_MANIFEST_BYTES} bytes, got {path.stat().st_size}")
    data = path.read_bytes()
    try:
        is_whole = (backup / DIGEST).read_text("utf-8", "replace") == _signature(data)
    except FileNotFoundError:
        is_whole = False
    if not is_whole:
        raise BackupBroken(f"{path}: expected the digest in {DIGEST}, got another; the backup is damaged")
    try:
        manifest = Manifest.model_validate_json(data)
    except ValidationError as error:
        raise BackupBroken(f"{path}: {first_problem(error)}") from error
    if manifest.version != VERSION:
        raise BadInput(f"{backup}: expected a backup of format {VERSION}, got format {manifest.version}")
    return manifest


def _signature(manifest: bytes) -> str:
    return f"{hashlib.sha256(manifest).hexdigest()}  {MANIFEST}\n"
