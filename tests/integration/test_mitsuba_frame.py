"""A frame of a scene of Mitsuba by the steps of a worker: probe, tiles, masters, depth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import MitsubaMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.resolved import StoredPlan
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.plan import artifact_names as names
from tests.builders import builtin_bundle, order_of, small_job, stored_picture, tiles_of
from tests.mitsuba_place import lend_mitsuba_place
from worker.engines.mitsuba import engine
from worker.engines.mitsuba.engine import MitsubaEngine
from worker.engines.mitsuba.version import Missing
from worker.images.read import read_channels
from worker.sandbox.bundle import pack_folder
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID, local_job, store_plan
from worker.tasks.probe import probe_job

SIZE = (12, 10)
"""The numbers of lenses, (rows, cols)."""


place = pytest.fixture(scope="module")(lend_mitsuba_place)


def framed(place: Workplace, *, tiles: tuple[int, int]) -> NDArray[np.float16]:
    """Return the integral image of a frame with depth, rendered in tiles."""
    spec = small_job("turning-knot", count=SIZE, capture={"depth": True}, tiles=tiles, render={"cache": False})
    place.store.delete(JOB_ID)  # or the tiles before would be taken for these
    local_job(place, spec, builtin_bundle("turning-knot"))
    store_plan(place, StoredPlan(tile_rows=tiles[0], tile_cols=tiles[1], probe_start_s=0, probe_s_per_px=0))
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    return stored_picture(place, names.integral_name(1))


def test_the_probe_measures_a_scene_that_may_be_tiled(place: Workplace) -> None:
    local_job(place, small_job("turning-knot", count=SIZE), builtin_bundle("turning-knot"))
    probe = probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor()).probe
    assert probe is not None
    assert probe.tileable
    assert not probe.parallel
    assert 0 < probe.s_per_px < 1e-3
    assert probe.camera is None


def test_the_probe_says_what_was_added_to_a_scene(place: Workplace, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        'file = "a.xml"\n[stage]\nlocation = [0, 0, 9]\nlook_at = [0, 0, 0]\nnear_mm = 8\nfar_mm = 9\n'
    )
    (tmp_path / "a.xml").write_text('<scene version="3.0.0"><shape type="sphere"/></scene>')
    local_job(place, small_job("mine", count=SIZE), pack_folder(tmp_path))
    probe = probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor()).probe
    assert probe is not None
    assert any("a.xml has no light" in note for note in probe.notes)


def test_tiles_are_the_whole_frame_and_depth_comes_with_it(place: Workplace) -> None:
    whole = framed(place, tiles=(1, 1))
    assert whole.shape == (96, 80, 3)
    assert len(np.unique(whole)) > 100
    with place.store.local_path(names.job_artifact(JOB_ID, names.depth_name(1))) as path:
        depth = read_channels(path, CHANNELS[:1])
    assert np.isfinite(depth).mean() > 0.9
    np.testing.assert_array_equal(framed(place, tiles=(2, 2)), whole)


def test_a_worker_without_mitsuba_says_why(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(engine, "mitsuba_version", lambda: Missing("no LLVM"))
    for ask in (MitsubaEngine().check_installed, MitsubaEngine().software):
        with pytest.raises(MitsubaMissing, match="Mitsuba does not work on this worker: no LLVM"):
            ask("povray")
