"""The paper's integral video, from nothing: a farm, a job, its files, and where to look."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.client import Client
from lippmann.client.fetch import Haul, fetch_job, haul_text
from lippmann.client.watch import follow_job
from lippmann.terminal.output import Talk
from service.schemas.job import Job

FULL_TURN = "1-45"
"""8 degrees a frame: 45 frames are 360 degrees."""


@dataclass(frozen=True)
class Demo:
    """What a demonstration made."""

    job: Job
    haul: Haul


def demo_job(frames: str) -> dict[str, Any]:
    """Return the job of Athineos et al. 2006: a fish that turns by 8 degrees a frame, 90 x 90 lenses of 8 x 8 pixels.

    The fish, its turn and the rig are the defaults of scene and job; they are said here to be read.
    """
    return {
        "scene": "fish",
        "title": "Fish over water, Athineos et al. 2006",
        "frames": frames,
        "fps": 8,
        "parameters": {"turn_deg_per_frame": 8},
        "rig": {"imaging_lens": "athineos-2006", "lens_array": {"count": [90, 90]}, "px_per_lens": 8},
    }


def run_demo(client: Client, *, frames: str, out: Path, talk: Talk) -> Demo:
    """Submit the job, watch it, bring its files; a job that does not end well raises JobEnded."""
    job = client.submit(demo_job(frames))
    talk.note(f"Job {job.id}: frames {job.frames.text} of {job.size.cols} x {job.size.rows} px, "
              f"{job.size.lens_cols} x {job.size.lens_rows} lenses.")  # fmt: skip
    for note in job.notes:
        talk.note(f"note: {note}")
    done = follow_job(client, job.id)
    return Demo(job=done, haul=fetch_job(client, job.id, out))


def demo_text(demo: Demo) -> str:
    """Return what was made and where to look."""
    out = demo.haul.folder
    return "\n".join(
        [
            haul_text(demo.haul),
            "",
            "Where to look:",
            f"  {out / 'video' / 'centre.mp4'}   the fish turning, as seen from straight ahead",
            f"  {out / 'video' / 'views.mp4'}    every view of every frame, one after the other: the parallax",
            f"  {out / 'orthoscopic'}/           what a microlens display shows: print it at the array's pitch",
            f"  {out / 'integral'}/              as captured, pseudoscopic: depth turned inside out",
            f"  {out / 'views'}/                 all views of a frame, side by side",
        ]
    )


def demo_data(demo: Demo) -> Mapping[str, Any]:
    """Return what was made, for programs."""
    files = [str(path) for path in demo.haul.files]
    return {"job": demo.job.model_dump(mode="json"), "folder": str(demo.haul.folder), "files": files}
