"""Pictures that lie, in the bundles of strangers: refused by name, and the worker lives."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

from lippmann.errors import BundleError
from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import parse_spec
from tests.bombs import BOMBS, LIES
from tests.builders import order_of
from worker.sandbox.bundle import pack_folder
from worker.sandbox.sandbox import SandboxMode
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import workplace
from worker.tasks.local import local_job
from worker.tasks.probe import probe_job

SCENE = """
title = "Mine"

[sheets]
files = "*.png"
pitch_px = 6.0
count = [8, 10]
px_per_lens = 6
"""
FEW_MB = 300


@pytest.mark.promise("Scenes", "A picture that lies about itself ends its own job, by name, and takes no memory.")
@pytest.mark.parametrize("mode", ["bwrap", "landlock"])
def test_a_picture_that_lies_ends_its_job_by_name_and_takes_no_memory(tmp_path: Path, mode: SandboxMode) -> None:
    place = workplace(WorkerSettings(data_dir=tmp_path / "data", slots=1, worker_name="test", sandbox=mode))
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    for name in ("PNG 32768 x 32768", "EXR of the largest window", "JPEG 65500 x 65500", "GIF", "gzip", *LIES):
        bundle = tmp_path / "bundle"
        bundle.mkdir(exist_ok=True)
        (bundle / "scene.toml").write_text(SCENE)
        (bundle / "0001.png").write_bytes(LIES.get(name) or BOMBS[name][0])
        local_job(place, parse_spec({"scene": "mine", "frames": "1"}), pack_folder(bundle))
        with pytest.raises(BundleError, match=r"^sheets\.files: 0001\.png: expected a whole picture, got 0001\.png: "):
            probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor())
        assert list(place.settings.attempts_dir.iterdir()) == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - peak_mb < FEW_MB
