"""The start of a worker: what others do meanwhile is no fault, and what forbids all work ends it with a reason."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from worker import app
from worker.settings import STOPPING


@pytest.fixture
def scratch(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The scratch folder of a worker that has not started."""
    monkeypatch.setattr(app, "settings", app.settings.model_copy(update={"data_dir": tmp_path}))
    return tmp_path / "scratch"


def test_a_worker_does_not_start_in_a_folder_that_cannot_be_made(scratch: Path) -> None:
    scratch.touch()
    with pytest.raises(SystemExit, match=r"^lippmann worker: expected files .* got .* exists"):
        app._prepare()


def test_old_stopping_files_are_removed_also_if_another_worker_removes_one_meanwhile(scratch: Path) -> None:
    scratch.mkdir()
    old, new, gone = (scratch / f"{STOPPING}{name}" for name in ("old", "new", "gone"))
    for file in (old, new, app.settings.stopping_file):
        file.touch()
    os.utime(old, (0.0, 0.0))
    gone.symlink_to("nowhere")  # It is listed, and cannot be found.
    app._remove_stopping_files()
    assert set(scratch.iterdir()) == {new, gone}
