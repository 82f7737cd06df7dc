"""The demonstration: the integral video of the paper, rendered on a farm that was started for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.client import Client
from lippmann.client.fetch import FetchResult, fetch_job, fetch_text
from lippmann.client.watch import watch_job
from lippmann.job.rendering.engines import Engine
from lippmann.terminal.output import Output
from service.schemas.job import Job


@dataclass(frozen=True)
class Demo:
    """The result of a demonstration."""

    job: Job
    fetched: FetchResult


def demo_job(frames: str, engine: Engine = "povray") -> dict[str, Any]:
    """Return the job of Athineos et al. 2006: a fish that turns by 8 degrees a frame, 90 x 90 lenses of 8 x 8 pixels.

    The fish, its turn and the rig are the defaults of the scene and the job; they are written out for the reader. For
    Mitsuba the scene is the same one in triangles.
    """
    mine: dict[str, Any] = {"scene": "fish-mesh"}
    if engine == "povray":
        mine = {"scene": "fish", "parameters": {"turn_deg_per_frame": 8}}
    return {
        **mine,
        "title": "Fish over water, Athineos et al. 2006",
        "frames": frames,
        "fps": 8,
        "rig": {"imaging_lens": "athineos-2006", "lens_array": {"count": [90, 90]}, "px_per_lens": 8},
    }


def run_demo(client: Client, *, frames: str, engine: Engine, out: Path, output: Output) -> Demo:
    """Submit the job, watch it and fetch its files.

    Raises
    ------
    JobEnded
        If the job failed or was cancelled.
    """
    job = client.submit(demo_job(frames, engine))
    output.note(
        f"Job {job.id}: frames {job.frames.text} of {job.size.cols} x {job.size.rows} px,"
        f" {job.size.lens_cols} x {job.size.lens_rows} lenses."
    )
    for note in job.notes:
        output.note(f"note: {note}")
    done = watch_job(client, job.id)
    return Demo(job=done, fetched=fetch_job(client, job.id, out, is_demo=True))


def demo_text(demo: Demo) -> str:
    """Return the result as text: the files, and what each of them shows."""
    out = demo.fetched.folder
    places = {
        f"{out / 'video' / 'centre.mp4'}": "the fish turning, as seen from straight ahead",
        f"{out / 'video' / 'views.mp4'}": "every view of every frame in succession, which shows the parallax",
        f"{out / 'orthoscopic'}/": "the integral images to print at the pitch of the array",
        f"{out / 'integral'}/": "the captures, which are pseudoscopic: their depth is inverted",
        f"{out / 'views'}/": "all views of a frame side by side",
    }
    width = max(map(len, places))
    lines = [f"  {place.ljust(width)}  {words}" for place, words in places.items()]
    return "\n".join([fetch_text(demo.fetched), "", "Where to look:", *lines])


def demo_data(demo: Demo) -> Mapping[str, Any]:
    """Return the result as data for programs."""
    files = [str(path) for path in demo.fetched.files]
    return {"job": demo.job.model_dump(mode="json"), "folder": str(demo.fetched.folder), "files": files}
