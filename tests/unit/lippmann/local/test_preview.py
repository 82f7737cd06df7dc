"""Previews without a farm: two pictures, the times, and once more when the job file changes."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from lippmann.errors import BadInput, LippmannError
from lippmann.local.preview import PreviewRequest, watch_previews, write_preview
from lippmann.plan.preview import PreviewSize
from tests.needs import needs_povray
from tests.pictures import read_png

SIZE = PreviewSize(6, 4)


def request(folder: Path, **more: object) -> PreviewRequest:
    given = {"scene": "target-letter", "job_file": None, "overrides": ()} | more
    return PreviewRequest(frame=None, size=SIZE, out=folder / "out", **given)  # type: ignore[arg-type]


@needs_povray
def test_a_preview_has_the_size_that_was_asked_for(tmp_path: Path) -> None:
    made = write_preview(request(tmp_path, overrides=("rig.lens_array.count=[12,8]",)))
    assert read_png(made.integral).shape == (24, 16, 3)
    assert read_png(made.view).shape == (6, 4, 3)
    assert (made.rig.lens_rows, made.rig.lens_cols, made.rig.pitch_mm) == (6, 4, 2.0)
    assert 0 < made.times.cpu_s < made.seconds
    assert len(made.notes) == 2
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["integral.png", "view.png"]


@needs_povray
def test_a_watched_job_is_rendered_when_it_changes_and_survives_a_mistake(tmp_path: Path) -> None:
    job, errors = tmp_path / "job.json", list[LippmannError]()

    def save(text: str, at_ns: int) -> None:
        job.write_text(text)
        os.utime(job, ns=(at_ns, at_ns))  # two changes within the clock of the file system are two

    def text(lenses: int) -> str:
        return json.dumps({"scene": "target-letter", "rig": {"lens_array": {"count": [lenses, lenses]}}})

    def mend(error: LippmannError) -> None:
        errors.append(error)
        save(text(3), 3)

    save(text(2), 1)
    previews = watch_previews(request(tmp_path, scene=None, job_file=str(job)), mend)
    assert next(previews).rig.lens_rows == 2
    save("{", 2)
    assert next(previews).rig.lens_rows == 3
    assert len(errors) == 1
    previews.close()  # type: ignore[attr-defined]


@pytest.mark.parametrize("job_file", [None, "-", "nowhere.json"])
def test_there_must_be_a_file_to_watch(tmp_path: Path, job_file: str | None) -> None:
    with pytest.raises(BadInput, match="to watch"):
        next(watch_previews(request(tmp_path, job_file=job_file), lambda error: None))
