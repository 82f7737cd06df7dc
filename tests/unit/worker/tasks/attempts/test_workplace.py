"""A workplace finds the sandbox of a bundle and the sheet of a job."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from lippmann.errors import WorkerOutdated
from lippmann.plan.artifact_names import JOB_FILE, job_artifact
from tests.builders import builtin_bundle, local_place, small_job, stored_job
from tests.unit.worker.tasks.scenes.test_bundle_folder import with_bundle
from worker.sandbox.bundle import digest_of
from worker.sandbox.detect import detect_once
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.tasks.attempts.workplace import workplace


def test_only_built_in_scenes_and_ones_own_files_do_without_a_sandbox(tmp_path: Path) -> None:
    place, uploaded = with_bundle(tmp_path)
    builtin = digest_of(builtin_bundle("target-white"))
    assert [place.sandbox_for(digest).allow_none for digest in (uploaded, builtin)] == [False, True]
    assert replace(place, own_files=True).sandbox_for(uploaded).allow_none


@pytest.fixture
def nothing_detected() -> Iterator[None]:
    """Forget what this process has detected, before and after a test."""
    detect_once.cache_clear()
    yield
    detect_once.cache_clear()


@pytest.mark.usefixtures("nothing_detected")
def test_the_pool_processes_of_a_worker_inherit_its_sandbox_and_try_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A trial that fails for a passing reason would leave a process without a sandbox for the rest of its life."""
    settings = WorkerSettings(data_dir=tmp_path, worker_name="w1", sandbox="bwrap", cgroup="none")
    monkeypatch.setattr("worker.sandbox.detect.trial", lambda sandbox: None)
    found = detect_once("bwrap", cgroup="none")  # as the presence of the worker does before the fork
    monkeypatch.setattr("worker.sandbox.detect.trial", lambda sandbox: "[Errno 11] Resource temporarily unavailable")
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply(_sandbox_of, (settings,)) == found


def _sandbox_of(settings: WorkerSettings) -> Sandbox:
    return workplace(settings).sandbox


@pytest.mark.parametrize("change", [{"filter": "b"}, {"clock": {"begin": 0, "end": 1, "loops": 2}}, {"file": 7}])
def test_a_job_with_a_field_of_a_newer_service_is_left_to_newer_workers(tmp_path: Path, change: dict[str, Any]) -> None:
    """Without the field, other pixels would be rendered under the same name."""
    place = local_place(tmp_path)
    job = stored_job(place, small_job("target-white"))
    assert place.job_sheet(job.job_id) == job
    name = job_artifact(job.job_id, JOB_FILE)
    place.store.put_bytes(name, json.dumps(job.model_dump(mode="json") | change).encode())
    with pytest.raises(WorkerOutdated, match=f"does not know {next(iter(change))}.* of job.json"):
        place.job_sheet(job.job_id)
    place.store.put_bytes(name, b"{")
    with pytest.raises(ValidationError):
        place.job_sheet(job.job_id)
