"""The render cache: a tile of one definition is rendered once. Here are the keys and the names of its entries.

The key of a tile is the SHA-256 of its definition: everything that the pixels depend on. Whatever a job says goes into
the definition unless it is listed here as something that changes no pixel; so a field that is added to jobs later
never makes two different tiles equal.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict

from lippmann.digest import Digest
from lippmann.job.rendering.channels import stored_channels
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile

CACHE = "cache"
"""The folder of the cache in the artifact store."""

ENTRY = "entry.json"
"""The file of an entry that is stored last. It is written again whenever the entry is used, so its time is that of the
last use."""

TILE, DEPTH, CHANNELS, POV, LOG = "tile.exr", "depth.exr", "channels.exr", "tile.pov", "log.txt"
"""The files of an entry: what a render leaves in a job."""

UNSEEN: dict[str, Any] = {
    "job_id": True,
    "clock": True,
    "spec": {
        "title": True,
        "frames": True,
        "fps": True,
        "display": True,
        "priority": True,
        "slots": True,
        "workers": True,
        "outputs": True,
        # Stage, parameters and animated numbers are in the definition as they are at the frame, and so is the clock.
        "stage": True,
        "parameters": True,
        "animation": True,
        "clock": True,
        "render": {
            "engine", "cache", "tiles", "timeout_s", "stall_s", "parse_timeout_s", "photons_timeout_s",
            "probe_timeout_s", "memory_mb",
        },
    },
}  # fmt: skip
"""The fields of a resolved job that change no pixel of a tile."""


@dataclass(frozen=True)
class RenderSoftware:
    """The software that makes the pixels of a tile, as a worker has it; each field is a version or a digest."""

    engine: str
    """The name of the engine."""
    engine_version: str
    engine_includes: str
    """The digest of the include files that come with the engine."""
    templates: str
    """The digest of our include files and templates."""
    code: str
    """The digest of the code of Lippmann."""


class CacheEntry(BaseModel):
    """The content of `entry.json`."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    job_id: str
    """The job that rendered the tile, which may have been removed since."""
    frame: int
    files: dict[str, Digest]
    """The digests of the files of the entry."""


def tile_key(
    job: ResolvedJob, frame: int, tile: Tile, software: RenderSoftware, *, reads_clock: bool, reads_frames: bool
) -> str:
    """Return the key of a tile in the render cache, 64 hexadecimal digits.

    Parameters
    ----------
    job
        The job; its animated numbers are taken at the frame.
    frame
        The number of the frame.
    tile
        The tile; its pixels count and its index does not.
    software
        The software that renders.
    reads_clock
        True if the scene reads the clock. Frames at different clocks are different frames only then.
    reads_frames
        True if the scene reads `frame_number` or another variable of the animation. They are in the key only then.
    """
    definition = {
        "job": job.at(frame).model_dump(mode="json", exclude=UNSEEN),
        "clock": job.clock.at(frame) if reads_clock else None,
        "animation": job.clock.variables(frame) if reads_frames else None,
        "tile": (tile.row_start, tile.row_stop, tile.col_start, tile.col_stop),
        "software": asdict(software),
        **_of_next_frame(job, frame),
    }
    text = json.dumps(definition, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _of_next_frame(job: ResolvedJob, frame: int) -> dict[str, Any]:
    """Return the part of the definition that is of the next frame: with the channel motion, its job and its clock."""
    if "motion" not in job.spec.capture.channels:
        return {}
    later = job.at(frame + 1).model_dump(mode="json", exclude=UNSEEN)
    return {"next_job": later, "next_clock": job.clock.at(frame + 1)}


def entry_folder(key: str) -> str:
    """Return the folder of an entry in the artifact store.

    >>> entry_folder("0a1b")
    'cache/0a/0a1b'
    """
    return f"{CACHE}/{key[:2]}/{key}"


def entry_files(spec: JobSpec, frame: int, tile: Tile, *, has_source: bool = True) -> Mapping[str, str]:
    """Return the files of an entry that a job receives, with their names below the job; the tile comes last.

    Parameters
    ----------
    has_source
        True if the engine renders a .pov, which is one of them.
    """
    depth = {DEPTH: names.depth_tile_name(frame, tile.index)} if spec.capture.depth else {}
    channels = {CHANNELS: names.channel_tile_name(frame, tile.index)} if stored_channels(spec.capture) else {}
    source = {POV: names.pov_name(frame, tile.index)} if has_source else {}
    return {**source, **depth, **channels, TILE: names.tile_name(frame, tile.index)}
