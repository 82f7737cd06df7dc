"""The slots of a real worker are handed over, and every frame is what it is when it is rendered alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lippmann.job.messages.orders import TaskKind
from lippmann.plan import artifact_names as names
from service.schemas.task import Task
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture, tiles_of
from tests.farm import ended
from tests.integration.lippmann.conftest import Up
from tests.needs import needs_povray
from worker.images.read import read_rgb
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.render import render_tile

pytestmark = needs_povray

SLOTS = 2
FRAMES = small_job("fish", count=(20, 20), frames="1-12", render={"cache": False}).model_copy(update={"outputs": ()})


def most_at_once(tasks: Sequence[Task]) -> int:
    """Return the largest number of attempts that ran at the same time."""
    held = [(task.started_at, task.ended_at) for task in tasks if task.started_at and task.ended_at]
    return max(sum(start <= begin < end for start, end in held) for begin, _ in held)


def test_the_next_frame_starts_while_the_one_before_it_ends_with_the_same_pixels(farm: Up, tmp_path: Path) -> None:
    with farm.client() as client:
        job = ended(client, client.submit(FRAMES).id)
        tasks = list(client.tasks(job.id))
    assert job.status == "done", job.error
    assert SLOTS < most_at_once(tasks) <= 2 * SLOTS
    place, (tile,) = local_place(tmp_path), tiles_of(FRAMES)
    stored_job(place, FRAMES)
    for frame in (2, 3, 9):
        render_tile(place, order_of(TaskKind.RENDER, frame=frame, tile=tile), NullMonitor())
        name = names.tile_name(frame, tile.index)
        of_farm = read_rgb(farm.data_dir / "artifacts" / names.job_artifact(job.id, name), np.float16)
        assert np.array_equal(of_farm, stored_picture(place, name))
