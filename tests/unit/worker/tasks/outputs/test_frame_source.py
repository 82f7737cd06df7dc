"""A master that cannot be read is reported with the number of its frame."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from lippmann.errors import ArtifactBroken, ArtifactMissing
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from worker.store.local import LocalStore
from worker.tasks.attempts.attempt import failure_of
from worker.tasks.outputs.frame_source import FrameSource

SPEC = JobSpec.model_validate({"scene": "fish", "frames": "1-3", "rig": {"lens_array": {"count": [4, 4]}}})


def _rows(source: FrameSource, frame: int) -> None:
    with source.orthoscopic_rows(frame):
        pass


@pytest.mark.parametrize("read", [FrameSource.image, FrameSource.depth, _rows])
@pytest.mark.parametrize("damaged", [False, True])
def test_the_failure_names_the_frame(tmp_path: Path, read: Callable[[FrameSource, int], object], damaged: bool) -> None:
    store = LocalStore(tmp_path)
    source = FrameSource(
        frames=SPEC.frame_numbers,
        fps=SPEC.fps,
        layout=display_size(SPEC.rig),
        rig=lambda _: SPEC.rig,
        display=SPEC.display,
        facts={},
        master=store.local_path,
        has_depth=True,
    )
    if damaged:
        for name in (names.orthoscopic_name(2), names.depth_name(2)):
            store.put_bytes(name, b"no picture")
    with pytest.raises(ArtifactBroken if damaged else ArtifactMissing) as raised:
        read(source, 2)
    assert failure_of(raised.value).frame == 2
