"""Mitsuba behind the protocol of engines: a warm program in the sandbox, one for all tasks of a job."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import MitsubaMissing
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob
from lippmann.plan.render_cache import RenderSoftware
from worker.engines.code import code_digest
from worker.engines.engine import Rendered, Room, SceneUse, Wanted
from worker.engines.mitsuba.inside.messages import FileKind, Request
from worker.engines.mitsuba.render import render
from worker.engines.mitsuba.session import SessionKey, slot
from worker.engines.mitsuba.version import Found, Missing, mitsuba_version

LARGEST_HALF = float(np.finfo(np.float16).max)
"""Light above it is stored as this: the tiles of a master are half floats."""

FILE_OF: dict[Channel, FileKind] = {
    "depth": "distance",
    "normal": "normal",
    "albedo": "albedo",
    "object": "object",
    "motion": "motion",
}
"""The file that the program writes for a channel."""


class MitsubaEngine:
    """Mitsuba; see `worker.engines.engine.Engine`."""

    name: Literal["mitsuba"] = "mitsuba"
    has_channels = True
    is_warm = True
    has_source = False

    def check_installed(self, program: str) -> None:
        """Check that Mitsuba works on this machine."""
        _found()

    def end(self) -> None:
        """End the program of this process, if there is one."""
        slot.end()

    def software(self, program: str) -> RenderSoftware:
        """Return the software that makes the pixels; the variants of Mitsuba differ in their last digits."""
        found = _found()
        return RenderSoftware(
            engine="mitsuba",
            engine_version=f"{found.version} {found.variant}, drjit {version('drjit')}",
            engine_includes="",
            templates="",
            code=code_digest(),
        )

    def scene_use(self, bundle: Path) -> SceneUse:
        """Return that a scene may read the clock and the number of the frame, which also seeds its samples."""
        return SceneUse()

    def is_parallel(self, job: ResolvedJob, bundle: Path) -> bool:
        """Return False: a tile is a request of its own, and more of them use more cores."""
        return False

    def render(self, wanted: Wanted, room: Room) -> Rendered:
        """Render a region of a frame, by the program that this process keeps for the job."""
        job, found = wanted.job, _found()
        key = SessionKey(
            owner=job.cache_scope, job_id=job.job_id, bundle=job.bundle, limits=room.limits, variant=found.variant
        )
        with slot.session(key, bundle=room.keep_bundle, folder=room.keep_folder, sandbox=room.sandbox) as session:
            number = session.requests + 1
            request = Request(
                number=number,
                job=job.at(wanted.frame),
                next_job=job.at(wanted.frame + 1) if "motion" in wanted.channels else None,
                frame=wanted.frame,
                rows=wanted.rows,
                cols=wanted.cols,
                region=wanted.part,
                channels=wanted.channels,
                light=wanted.light,
                bundle=str(session.bundle),
                out=str(number),
            )
            region = render(
                session,
                request,
                times=room.times,
                on_progress=room.on_progress,
                should_stop=room.should_stop,
                log=room.log,
            )
        radiance = region.pixels.get("radiance", np.zeros((*request.shape, 3), np.float32))
        light = np.minimum(radiance, LARGEST_HALF).astype(np.float16)
        return Rendered(
            light=light,
            start_s=max(0.0, region.wall_s - region.trace_s),
            trace_cpu_s=min(region.cpu_s, region.trace_s),
            channels={channel: _channel(region.pixels[FILE_OF[channel]]) for channel in wanted.channels},
            objects=region.objects,
            notes=region.notes,
        )


def _channel(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the pixels of a channel without an axis of one number."""
    return pixels[..., 0] if pixels.shape[2] == 1 else pixels


def _found() -> Found:
    found = mitsuba_version()
    if isinstance(found, Missing):
        raise MitsubaMissing(f"Mitsuba does not work on this worker: {found.reason}.")
    return found
