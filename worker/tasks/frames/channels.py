"""The files of a tile besides its colours: depth and other channels, rendered with the colours or before them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import Order
from lippmann.job.rendering.channels import CHANNEL_PARTS, channel_attributes, part_names, stored_channels
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.optics.rig.bench import bench
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import Tile
from worker.engines.choose import engine_of
from worker.engines.engine import Rendered
from worker.images.write import write_channels
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.frames.depth_pass import depth_map

Numbers = NDArray[np.float32]


@dataclass(frozen=True)
class TileChannels:
    """The depth and the other channels of a tile, one ray a pixel, as captured."""

    depth: DepthMap | None = None
    others: Mapping[Channel, Numbers] = field(default_factory=dict)
    """`(row, col)` or `(row, col, number)` by channel."""
    objects: Sequence[str] = ()
    """The names of the objects from number 1."""


def engine_channels(sheet: ResolvedJob) -> tuple[Channel, ...]:
    """Return the channels that the engine of a job renders with the colours."""
    if not engine_of(sheet).has_channels:
        return ()
    depth: tuple[Channel, ...] = ("depth",) if sheet.spec.capture.depth else ()
    return (*depth, *stored_channels(sheet.spec.capture))


def channels_of(
    rendered: Rendered, sheet: ResolvedJob, frame: int, tile: Tile, monitor: ProgressMonitor
) -> TileChannels:
    """Return the channels that an engine has rendered of a tile; the exact rays make depth of its distances."""
    found = dict(rendered.channels)
    distance_mm = found.pop("depth", None)
    depth = None
    if distance_mm is not None:
        there = sheet.at(frame)
        seen_mm = np.where(np.isfinite(distance_mm), distance_mm, np.float32(np.nan))
        depth = depth_map(seen_mm, bench(there.spec.rig, reference_mm=there.stage.reference_mm), tile, monitor)
    return TileChannels(depth, found, rendered.objects)


def store_channels(
    found: TileChannels,
    order: Order,
    tile: Tile,
    artifacts: TaskArtifacts,
    folder: Path,
    *,
    attributes: Mapping[str, str],
) -> None:
    """Store the depth and the channels of a tile; the tile itself comes later and means all of them."""
    assert order.frame is not None  # noqa: S101 - it was rendered
    size = tile.rows, tile.cols
    path = folder / "numbers.exr"
    if found.depth is not None:
        write_channels(path, (found.depth.values,), CHANNELS, size=size, attributes=attributes)
        artifacts.put(names.depth_tile_name(order.frame, tile.index), path)
    if found.others:
        order_of_parts = tuple(channel for channel in CHANNEL_PARTS if channel in found.others)
        values = np.concatenate([found.others[each].reshape(*size, -1) for each in order_of_parts], axis=-1)
        more = channel_attributes(order_of_parts, found.objects)
        parts = part_names(order_of_parts)
        write_channels(path, (values,), parts, size=size, attributes={**attributes, **more})
        artifacts.put(names.channel_tile_name(order.frame, tile.index), path)
