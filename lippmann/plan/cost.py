"""The cost of a task, and the number of tiles of a frame that follows."""

from __future__ import annotations

import math

from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import MOST_THREADS
from lippmann.job.spec import JobSpec
from lippmann.plan.sampling import frame_size

WORTHWHILE_S = 5.0
"""The least duration of a task; a shorter one is mostly the start of POV-Ray (0.67 s, measured)."""
COMFORTABLE_S = 60.0
"""The longest duration of a task; a longer one makes a lost worker or a late finish expensive."""
COMFORTABLE_PX = 3_000_000
"""The most rendered pixels of a tile; more rays of the ray camera take over half a GB in POV-Ray (measured)."""
MOST_WHOLE_PX = 12_000_000
"""The most rendered pixels of a whole frame that several threads share; the worker has them all in memory."""
TILES_PER_SLOT = 2
"""The tiles of a slot where frames are cut for the slots. One part of a picture costs more than another: the two halves
of a fish over water take 30 and 21 s (measured). Of four quarters, two slots take a cheap and an expensive one each."""

DEPTH_MAP_S_PER_PX = 8e-6
"""CPU seconds per pixel to convert distances to depths on the display: 4.0 s for 518,400 px (measured)."""


def depth_s_per_px(spec: JobSpec, probe: ProbeResult) -> float:
    """Return the seconds per pixel of a depth pass: a second picture of one ray a pixel, and its exact rays."""
    if not spec.capture.depth:
        return 0.0
    return probe.s_per_px / spec.rays_per_px + DEPTH_MAP_S_PER_PX


def tile_grid(spec: JobSpec, probe: ProbeResult, *, slots: int, idle_workers: int = 0) -> tuple[int, int]:
    """Return (tile_rows, tile_cols) for every frame of a job.

    The tiles that the job names are used. Otherwise no tile takes much longer than a minute or has too many pixels, and
    no slot idles while a short sequence renders, but no tile is shorter than what is worthwhile. Frames that one worker
    renders with threads in all its slots are not cut, nor are scenes whose tiles would differ from the whole.

    Parameters
    ----------
    idle_workers
        The number of workers that have these slots; 0 if they have other work.
    """
    size, settings = frame_size(spec.rig), spec.render
    if not probe.tileable or not settings.may_be_tiled:
        return (1, 1)
    if settings.tiles != "auto":
        rows, cols = settings.tiles
        return (min(rows, size.lens_rows), min(cols, size.lens_cols))
    pixels_s = size.px * (probe.s_per_px + depth_s_per_px(spec, probe))
    rendered_px = size.px * spec.rays_per_px
    has_room = idle_workers == 1 and rendered_px <= MOST_WHOLE_PX
    if probe.parallel and has_room and _shares_slots(len(spec.frame_numbers), pixels_s, slots=slots):
        return (1, 1)
    for_length = math.ceil(pixels_s / COMFORTABLE_S)
    for_slots = _tiles_for_slots(len(spec.frame_numbers), slots)
    for_memory = math.ceil(rendered_px / COMFORTABLE_PX)
    worthwhile = max(1, int(pixels_s / WORTHWHILE_S))
    return (min(max(min(max(for_length, for_slots), worthwhile), for_memory), size.lens_rows, 100), 1)


def threads_of_each(tasks: int, *, slots: int) -> int:
    """Return the number of threads of each of a few tasks that have all slots of a worker.

    >>> [threads_of_each(tasks, slots=8) for tasks in (1, 2, 3, 8, 20)]
    [8, 4, 3, 1, 1]
    """
    return min(math.ceil(slots / tasks), MOST_THREADS)


def _shares_slots(frames: int, frame_s: float, *, slots: int) -> bool:
    """Return whether the frames of a job, fewer than the slots of a worker, are rendered with threads in all slots.

    Then the scene is parsed once for a frame, and the threads end together, whichever part of the picture costs more.
    """
    return frames < slots <= frames * MOST_THREADS and frames * frame_s <= slots * COMFORTABLE_S


def _tiles_for_slots(frames: int, slots: int) -> int:
    """Return the number of tiles of a frame with which all slots end at about the same time.

    >>> [_tiles_for_slots(frames, 2) for frames in (1, 2, 3, 5, 12)]
    [4, 1, 2, 1, 1]
    """
    return 1 if frames % slots == 0 else math.ceil(TILES_PER_SLOT * slots / frames)
