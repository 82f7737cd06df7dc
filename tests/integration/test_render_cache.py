"""The render cache with real POV-Ray: a tile of one definition is rendered once, and a hit is as good as a render."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from lippmann.errors import StoreFull
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import read_digest
from lippmann.plan.render_cache import CACHE, DEPTH, ENTRY, LOG, POV, TILE
from tests.builders import local_place, small_job, tiles_of
from tests.damaging import DAMAGES, Damage
from worker.sandbox.bundle import check_bundle, pack_folder
from worker.store.local import LocalStore
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID

MANIFEST = """
title = "A ball"
[stage]
location = [0.0, 0.0, -500.0]
look_at = [0.0, 0.0, 0.0]
near_mm = 400.0
far_mm = 600.0
[parameters.glow]
type = "number"
default = 0.5
"""
BALL = """
light_source { <-300, 400, -600> 1 }
sphere { 0, 60 pigment { rgb <glow, 0.4, 0.2> } }
"""


def job(**more: Any) -> JobSpec:
    return small_job("ball", count=(4, 4), px_per_lens=4, tiles=[2, 1], frames="1-8", **more)


def store_job(place: Workplace, spec: JobSpec, *, text: str = BALL, job_id: str = JOB_ID) -> None:
    """Store a job on a scene of one file, as the service would."""
    folder = place.settings.data_dir / "ball"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(MANIFEST)
    (folder / "scene.inc").write_text(text)
    bundle = pack_folder(folder)
    checked = check_bundle(bundle)
    place.store.put_bytes(names.bundle_name(checked.digest), bundle)
    sheet = ResolvedJob.of(job_id, spec, checked.card, bundle=checked.digest)
    place.store.put_bytes(names.job_artifact(job_id, names.JOB_FILE), sheet.model_dump_json().encode())
    plan = '{"tile_rows": 2, "tile_cols": 1, "probe_start_s": 0, "probe_s_per_px": 0}'
    place.store.put_bytes(names.job_artifact(job_id, names.PLAN_FILE), plan.encode())


def rendered(place: Workplace, *, frame: int = 1, tile: int = 0, job_id: str = JOB_ID, attempt: int = 1) -> TaskResult:
    order = Order(
        kind=TaskKind.RENDER, job_id=job_id, task_id="t", attempt="a", attempt_number=attempt, frame=frame,
        tile=tiles_of(job())[tile].index,
    )  # fmt: skip
    return render_tile(place, order, NullMonitor())


def files_of(place: Workplace, job_id: str, frame: int) -> dict[str, bytes]:
    """Return what a frame has of the job's artifacts, without the log."""
    found = [info.name for info in place.store.list(job_id) if f"/{frame:04d}/" in info.name]
    return {
        name.replace(f"{job_id}/", "").replace(f"/{frame:04d}/", "/"): place.store.get_bytes(name) for name in found
    }


def entry_of(place: Workplace) -> Path:
    (entry,) = (place.settings.artifacts_dir / CACHE).glob("*/*")
    return entry


def log_of(place: Workplace, job_id: str, frame: int, attempt: int = 1) -> str:
    name = names.log_name(TaskKind.RENDER, frame, tiles_of(job())[0].index, None, attempt)
    return place.store.get_bytes(names.job_artifact(job_id, name)).decode()


@pytest.mark.parametrize("capture", [{"depth": True}, {"method": "glass"}])
def test_a_hit_gives_a_job_everything_that_a_render_gives(tmp_path: Path, capture: dict[str, Any]) -> None:
    place = local_place(tmp_path)
    store_job(place, job(capture=capture))
    store_job(place, job(capture=capture, render={"cache": False}, title="Once more"), job_id="plain")
    store_job(place, job(capture=capture, title="Another", priority=90), job_id="second")
    first, plain = rendered(place), rendered(place, frame=3, job_id="plain")
    assert not first.cached
    assert not plain.cached
    for job_id, frame in ((JOB_ID, 2), ("second", 5)):
        hit = rendered(place, frame=frame, job_id=job_id)
        assert hit.cached
        assert [*hit.digests.values()] == [*first.digests.values()] == [*plain.digests.values()]
        assert {name for name in hit.digests if not place.store.exists(f"{job_id}/{name}")} == set()
        assert files_of(place, job_id, frame) == files_of(place, "plain", 3)
        log = log_of(place, job_id, frame)
        assert re.match(r"This tile comes from the render cache, entry [0-9a-f]{64}\. .* frame 1 of the job local", log)
        assert log.endswith(log_of(place, JOB_ID, 1))
        assert "povray" in log


def test_another_tile_and_another_value_of_a_parameter_are_rendered(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    swell = {"glow": {"keyframes": [[1, 0], [4, 1], [5, 0], [8, 1]]}}
    store_job(place, job(parameters=swell))
    cached = [rendered(place, frame=frame).cached for frame in range(1, 9)]
    assert cached == [False] * 4 + [True] * 4
    assert not rendered(place, tile=1).cached
    assert files_of(place, JOB_ID, 6) == {
        name: data for name, data in files_of(place, JOB_ID, 2).items() if "00-00" in name
    }


def test_frames_at_other_clocks_are_rendered_where_the_scene_reads_the_clock(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    text = BALL.replace("0, 60", "0, 60 + clock")
    store_job(place, job(clock={"repeat_frames": 2}), text=text)
    assert [rendered(place, frame=frame).cached for frame in (1, 2, 3, 4)] == [False, False, True, True]
    store_job(place, job(), text=text, job_id="other")
    assert [rendered(place, frame=frame, job_id="other").cached for frame in (1, 2, 3)] == [True, True, False]


def test_a_scene_that_reads_the_time_of_day_is_rendered_every_time(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    store_job(place, job(), text=BALL + "#declare Dice = seed(now * 1000);")
    assert not rendered(place).cached
    assert not rendered(place, frame=2).cached
    assert not place.store.list(CACHE)


def test_without_the_cache_a_job_takes_nothing_and_stores_nothing(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    store_job(place, job(render={"cache": False}))
    rendered(place)
    assert not place.store.list(CACHE)
    store_job(place, job(), job_id="cached")
    rendered(place, job_id="cached")
    assert not rendered(place, frame=2).cached


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", [TILE, DEPTH, POV, LOG, ENTRY])
def test_a_damaged_entry_is_rendered_and_whole_again(tmp_path: Path, damage: Damage, file: str) -> None:
    place = local_place(tmp_path)
    store_job(place, job(capture={"depth": True}))
    whole = rendered(place).digests
    damage(entry_of(place) / file)
    again = rendered(place, frame=2)
    assert not again.cached
    assert [*again.digests.values()] == [*whole.values()]
    assert rendered(place, frame=3).cached


def test_an_attempt_after_the_first_renders_and_its_tile_replaces_the_entry(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    store_job(place, job())
    rendered(place)
    before = (entry_of(place) / TILE).stat().st_ino
    place.store.delete(f"{JOB_ID}/tiles")
    assert not rendered(place, attempt=2).cached
    assert (entry_of(place) / TILE).stat().st_ino != before
    assert rendered(place, frame=2).cached


def test_jobs_and_the_cache_outlive_each_other(tmp_path: Path) -> None:
    place = local_place(tmp_path)
    store_job(place, job())
    store_job(place, job(), job_id="second")
    digests = rendered(place).digests
    place.store.delete(f"{JOB_ID}/tiles")
    hit = rendered(place, job_id="second")
    assert hit.cached
    place.store.delete(CACHE)
    assert [read_digest(place.store, f"second/{name}") for name in digests] == [*digests.values()]


def test_a_store_that_refuses_the_entry_costs_no_attempt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = local_place(tmp_path)
    store_job(place, job())

    def refuse(*_: object) -> None:
        raise StoreFull("no room")

    with monkeypatch.context() as patched:
        patched.setattr(LocalStore, "link", refuse)
        assert rendered(place).digests
    assert not rendered(place, frame=2).cached
    assert rendered(place, frame=3).cached


def test_povray_gives_a_scene_no_number_of_the_frame(tmp_path: Path) -> None:
    scene = '#debug concat("FRAME ", str(frame_number + initial_frame + final_frame, 0, 0), "\\n") sphere { 0, 1 }'
    (tmp_path / "a.pov").write_text("#version 3.7; global_settings { assumed_gamma 1 } " + scene)
    for clock in ("0", "7"):
        argv = ["povray", "+Ia.pov", "+Oa.png", "+W4", "+H4", "-D", "-P", f"+K{clock}"]
        done = subprocess.run(argv, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert "FRAME 0" in done.stderr
