"""The camera of a scene: what fails for the worker's sake is no property of the scene."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import LippmannError, OutOfMemory, SceneError, ScratchDamaged, StoreUnavailable
from tests.builders import local_place, small_job, stored_job
from worker.engines.povray.scenes.scene_variables import SceneVariables
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.scenes import scene_notes
from worker.tasks.scenes.scene_notes import UNKNOWN, examine_scene


@pytest.mark.parametrize(
    ("error", "is_quiet"),
    [(SceneError("no"), True), (OutOfMemory(), True), (ScratchDamaged(), False), (StoreUnavailable("away"), False)],
)
def test_only_a_scene_that_fails_has_an_unknown_camera(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: LippmannError, is_quiet: bool
) -> None:
    asked = []

    def read(place: object, sheet: object, frame: int, **_: object) -> None:
        asked.append(frame)
        raise error

    place = local_place(tmp_path)
    sheet = stored_job(place, small_job("target-white", frames="3-4"))
    monkeypatch.setattr(scene_notes, "read_scene_camera", read)
    monkeypatch.setattr(SceneVariables, "has_camera", lambda *_: True)
    with AttemptLog(tmp_path / "log.txt") as log:
        if is_quiet:
            found = examine_scene(place, sheet, folder=tmp_path, log=log, monitor=NullMonitor())
            assert (found.camera, UNKNOWN in found.notes) == (None, True)
            assert asked[:2] == [1, 3], "a job need not render frame 1"
        else:
            with pytest.raises(type(error)):
                examine_scene(place, sheet, folder=tmp_path, log=log, monitor=NullMonitor())
