"""Scratch folders: those of living attempts are kept, those of dead ones are removed; bundles are complete."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Barrier
from typing import Any

import pytest
from pydantic import ValidationError

from lippmann.errors import BundleError, SceneError, ScratchDamaged, WorkerOutdated
from lippmann.plan.artifact_names import JOB_FILE, bundle_name, job_artifact
from tests.builders import builtin_bundle, local_place, small_job, stored_job
from tests.needs import need_to_run
from tests.waiting import ENOUGH_S
from worker.sandbox.bundle import digest_of, pack_folder
from worker.settings import WorkerSettings
from worker.tasks.workplace import UNPACKED, Workplace, folder_lock, sweep_scratch

SCENE = """
title = "A ball"
file = "a.pov"

[stage]
location = [0, 0, -10]
look_at = [0, 0, 0]
near_mm = -20
far_mm = 20
"""

_KILLED = """
import os, signal, sys
from pathlib import Path
from tests.builders import local_place
with local_place(Path(sys.argv[1])).task_folder() as folder:
    (folder / "left").write_text("behind")
    folder.with_name(folder.name + ".txt").write_text("a log")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_folder_of_a_killed_worker_is_swept_and_of_a_living_one_kept(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    subprocess.run([sys.executable, "-c", _KILLED, str(tmp_path)], check=False)
    dead, log = sorted(settings.attempts_dir.iterdir())
    living = settings.attempts_dir / "living"
    living.mkdir()
    with folder_lock(living):
        sweep_scratch(settings)
        assert not dead.exists()
        assert not log.exists()
        assert living.exists()


def test_a_new_folder_that_is_not_locked_yet_is_not_swept(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    new = settings.attempts_dir / "new"
    new.mkdir(parents=True)
    with ThreadPoolExecutor(1) as pool, ExitStack() as attempt:
        with folder_lock(settings.attempts_dir, wait=True):
            swept = pool.submit(sweep_scratch, settings)
            with pytest.raises(TimeoutError):
                swept.result(timeout=1)
            attempt.enter_context(folder_lock(new))
        swept.result(ENOUGH_S)
        assert new.exists()


def test_a_folder_to_which_a_dying_program_still_writes_is_removed_a_little_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    (settings.attempts_dir / "dead" / "below").mkdir(parents=True)
    remove_empty, writes = os.rmdir, iter(["a picture", "a log"])

    def written_to_meanwhile(path: str, **options: Any) -> None:
        if path == "below" and (name := next(writes, None)):
            (settings.attempts_dir / "dead" / "below" / name).touch()
        remove_empty(path, **options)

    monkeypatch.setattr(os, "rmdir", written_to_meanwhile)
    sweep_scratch(settings)
    assert list(settings.attempts_dir.iterdir()) == []
    assert "not removed" not in capsys.readouterr().out


def test_a_locked_folder_cannot_be_locked_again(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(BlockingIOError), folder_lock(tmp_path):
        pass


def test_a_lock_is_free_once_it_was_released_although_a_process_was_forked_meanwhile(tmp_path: Path) -> None:
    with folder_lock(tmp_path):
        child = os.fork()
        if child == 0:
            signal.pause()
    try:
        with folder_lock(tmp_path):
            pass
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_a_bundle_is_unpacked_once_and_its_folder_exists(tmp_path: Path) -> None:
    place, digest = _with_bundle(tmp_path)
    with place.bundle(digest) as folder:
        assert sorted(path.name for path in folder.iterdir()) == ["a.pov", "scene.toml"]
        number = folder.stat().st_ino
    with place.bundle(digest) as again:
        assert (again, again.stat().st_ino) == (folder, number)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "a file removed": lambda folder: (folder / "a.pov").unlink(),
    "a file changed": lambda folder: (folder / "a.pov").write_text("sphere { 0, 9 }"),
    "a file added": lambda folder: (folder / "b.inc").touch(),
    "the folder removed": shutil.rmtree,
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_what_is_made_of_a_damaged_bundle_counts_for_nothing_and_the_next_use_unpacks_it_again(
    tmp_path: Path, damage: Callable[[Path], object]
) -> None:
    place, digest = _with_bundle(tmp_path)

    def damage_and_blame(folder: Path) -> None:
        damage(folder)
        raise SceneError("the scene is to blame")

    for use in (damage, damage_and_blame):
        with pytest.raises(ScratchDamaged):
            _use(place, digest, use)
    with place.bundle(digest) as folder:
        assert (folder / "a.pov").read_text() == "sphere { 0, 1 }"
    damage(folder)
    with place.bundle(digest) as folder:
        assert sorted(path.name for path in folder.iterdir()) == ["a.pov", "scene.toml"]


def test_a_bundle_that_was_replaced_while_it_was_used_was_damaged(tmp_path: Path) -> None:
    place, digest = _with_bundle(tmp_path)

    def miss_what_another_attempt_replaces(folder: Path) -> None:
        (folder / "a.pov").unlink()
        with place.bundle(digest):
            assert (folder / "a.pov").is_file()
        raise SceneError("there was no a.pov")

    with pytest.raises(ScratchDamaged):
        _use(place, digest, miss_what_another_attempt_replaces)


def _use(place: Workplace, digest: str, use: Callable[[Path], object]) -> None:
    with place.bundle(digest) as folder:
        use(folder)


@pytest.mark.promise(
    "Between processes", "A worker unpacks a scene bundle only if its content is the one that its digest names."
)
def test_a_bundle_with_other_content_than_its_name_says_is_refused_and_nothing_is_left(tmp_path: Path) -> None:
    place, digest = _with_bundle(tmp_path)
    other = "0" * 64
    place.store.put_bytes(bundle_name(other), place.store.get_bytes(bundle_name(digest)))
    with pytest.raises(BundleError, match="other content"), place.bundle(other):
        pass
    assert list(place.settings.bundles_dir.iterdir()) == []


def test_only_built_in_scenes_and_ones_own_files_do_without_a_sandbox(tmp_path: Path) -> None:
    place, uploaded = _with_bundle(tmp_path)
    builtin = digest_of(builtin_bundle("target-white"))
    assert [place.sandbox_for(digest).allow_none for digest in (uploaded, builtin)] == [False, True]
    assert replace(place, own_files=True).sandbox_for(uploaded).allow_none


def test_a_bundle_that_cannot_be_published_is_an_error_and_nothing_is_left(tmp_path: Path) -> None:
    place, digest = _with_bundle(tmp_path)
    bundles = place.settings.bundles_dir
    bundles.mkdir(parents=True)
    folder = f"{digest}-{UNPACKED}"
    (bundles / folder).write_bytes(b"a file in the way")
    with pytest.raises(NotADirectoryError), place.bundle(digest):
        pass
    assert [path.name for path in bundles.iterdir()] == [folder]


def test_attempts_that_unpack_one_bundle_at_the_same_time_all_get_its_folder(tmp_path: Path) -> None:
    place, digest = _with_bundle(tmp_path)
    starts = Barrier(8)

    def unpacked(_: int) -> Path:
        starts.wait(60)
        with place.bundle(digest) as folder:
            return folder

    with ThreadPoolExecutor(8) as pool:
        folders = set(pool.map(unpacked, range(8)))
    folder = f"{digest}-{UNPACKED}"
    assert {path.name for path in place.settings.bundles_dir.iterdir()} == {folder, f"{folder}.json"}
    assert folders == {place.settings.bundles_dir / folder}


def test_one_scratch_folder_that_cannot_be_removed_keeps_no_other_and_is_logged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    settings.bundles_dir.mkdir(parents=True)
    for name in ("kept", "removed"):
        (settings.bundles_dir / name).mkdir()
        os.utime(settings.bundles_dir / name, (0, 0))
    with _mount_point(settings.bundles_dir / "kept"):
        os.utime(settings.bundles_dir / "kept", (0, 0))
        sweep_scratch(settings)
    assert [path.name for path in settings.bundles_dir.iterdir()] == ["kept"]
    assert "scratch folder not removed" in capsys.readouterr().out


def _with_bundle(folder: Path) -> tuple[Workplace, str]:
    """Return a place whose store has a bundle, and the bundle's digest."""
    place, files = local_place(folder / "data"), folder / "scene"
    files.mkdir()
    (files / "scene.toml").write_text(SCENE)
    (files / "a.pov").write_text("sphere { 0, 1 }")
    bundle = pack_folder(files)
    place.store.put_bytes(bundle_name(digest_of(bundle)), bundle)
    return place, digest_of(bundle)


@contextmanager
def _mount_point(folder: Path) -> Iterator[None]:
    """Make a folder that cannot be removed, also by root."""
    need_to_run(["mount", "-t", "tmpfs", "tmpfs", folder], what="cannot mount a file system")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True, timeout=30)


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
