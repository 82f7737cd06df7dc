"""A worker without a sandbox: whose scene it is decides, and no setting does."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.resolved import StoredPlan
from povtemplates.catalogue import scene_folders
from tests.builders import local_place, order_of, small_job, stored_job, tiles_of
from tests.needs import needs_povray
from worker.sandbox.bundle import pack_folder
from worker.sandbox.sandbox import Sandbox
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.render import render_tile
from worker.tasks.local import local_job, store_plan
from worker.tasks.probe import probe_job

SPEC = small_job("target-white", count=(4, 4), render={"cache": False})


@pytest.fixture
def place(tmp_path: Path) -> Workplace:
    """Return a workplace as `LIPPMANN_SANDBOX=none` gives it."""
    return replace(local_place(tmp_path / "data"), sandbox=Sandbox("none"))


@pytest.mark.promise("Scenes", "A worker without a sandbox runs no uploaded scene, whatever the settings.")
def test_an_uploaded_scene_is_refused_before_anything_of_it_runs(place: Workplace, tmp_path: Path) -> None:
    scene = tmp_path / "scene"
    shutil.copytree(scene_folders()["target-white"], scene)
    (tmp_path / "admin.key").write_text("the key of the administrator")
    for file in scene.glob("*.inc"):
        file.write_text(f'#include "{tmp_path}/admin.key"\n{file.read_text()}')
    local_job(place, SPEC, pack_folder(scene))
    store_plan(place, StoredPlan(tile_rows=1, tile_cols=1, probe_start_s=0.0, probe_s_per_px=0.0))
    (tile,) = tiles_of(SPEC)
    for kind, do in ((TaskKind.PROBE, probe_job), (TaskKind.RENDER, render_tile)):
        with pytest.raises(SandboxMissing, match="expected a worker with a sandbox for an uploaded scene") as refused:
            do(place, order_of(kind, tile=tile), NullMonitor())
        assert "administrator" not in refused.value.message
    assert not any(b"administrator" in path.read_bytes() for path in place.settings.artifacts_dir.rglob("*.txt"))


@needs_povray
def test_a_scene_that_comes_with_the_project_is_rendered(place: Workplace) -> None:
    stored_job(place, SPEC)
    (tile,) = tiles_of(SPEC)
    assert render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor()).digests
