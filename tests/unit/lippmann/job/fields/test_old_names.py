"""Old names are accepted for one release, with a note that names the new one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.fields import old_names
from lippmann.job.fields.old_names import current_job, rename_settings
from lippmann.job.spec import JobSpec, parse_spec
from service.settings import Settings
from tests.repository import DOCS
from worker.settings import WorkerSettings

OLD_JOB = {"scene": "fish", "capture": {"method": "raytraced", "supersample": 2}}
NOTE = "capture.method raytraced is now glass; the next release refuses the old name"


def test_the_old_word_for_glass_is_taken_with_a_note() -> None:
    with pytest.warns(FutureWarning, match=NOTE):
        spec = parse_spec(OLD_JOB)
    assert (spec.capture.method, spec.capture.supersample) == ("glass", 2)
    assert OLD_JOB["capture"] == {"method": "raytraced", "supersample": 2}, "the data of the caller is not changed"


def test_a_job_that_an_earlier_release_stored_is_read_without_a_word() -> None:
    stored = parse_spec({"scene": "fish"}).model_dump_json().replace('"auto"', '"raytraced"', 1)
    assert "raytraced" in stored
    assert JobSpec.model_validate_json(stored).capture.method == "glass"


@pytest.mark.parametrize(
    "job", [{"scene": "fish"}, {"capture": {"method": "glass"}}, {"capture": []}, {"capture": {"method": 3}}, [], None]
)
def test_what_has_no_old_name_stays_as_it_is(job: Any) -> None:
    assert current_job(job) == (job, ())


@pytest.mark.parametrize(
    ("fields", "job", "expected"),
    [
        ({"old": "new"}, {"old": 1, "b": 2}, {"new": 1, "b": 2}),
        ({"rig.old": "new"}, {"rig": {"old": 1}}, {"rig": {"new": 1}}),
        ({"outputs.*.old": "new"}, {"outputs": ["a", {"old": 1}, {}]}, {"outputs": ["a", {"new": 1}, {}]}),
        ({"old": "new"}, {"old": 1, "new": 2}, {"old": 1, "new": 2}),
    ],
)
def test_a_field_is_renamed_where_it_stands_and_never_over_the_new_one(
    fields: Mapping[str, str], job: Any, expected: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(old_names, "JOB_FIELDS", fields)
    current, notes = current_job(job)
    assert current == expected
    assert len(notes) == (current != job)


@pytest.mark.parametrize("kind", [Settings, WorkerSettings])
def test_an_old_variable_sets_its_successor_and_is_named_in_the_log(
    kind: type[Settings | WorkerSettings], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(old_names, "SETTINGS", {"LIPPMANN_FOLDER": "LIPPMANN_DATA_DIR"})
    monkeypatch.setenv("LIPPMANN_DATA_DIR", "")  # Only what was set is taken back after the test.
    monkeypatch.delenv("LIPPMANN_DATA_DIR")
    monkeypatch.setenv("LIPPMANN_FOLDER", "/there")
    assert kind().data_dir == Path("/there")
    assert "LIPPMANN_FOLDER is now LIPPMANN_DATA_DIR" in caplog.text


def test_every_old_name_is_documented_with_its_new_one() -> None:
    settings, job_file = ((DOCS / name).read_text("utf-8") for name in ("settings.md", "job-file.md"))
    for old, new in old_names.SETTINGS.items():
        assert f"| `{old}` | `{new}` |" in settings
    for path, values in old_names.JOB_VALUES.items():
        for old, new in values.items():
            assert f'| `{path}: "{old}"` | `{path}: "{new}"` |' in job_file
    for path in old_names.JOB_FIELDS:
        assert f"| `{path}` | " in job_file


def test_the_new_variable_goes_before_the_old_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(old_names, "SETTINGS", {"OLD": "NEW"})
    environment = {"OLD": "1", "NEW": "2", "OTHER": "3"}
    note = "OLD is now NEW; the next release refuses the old name"
    assert rename_settings(environment) == (f"{note}; NEW is set too, so OLD is ignored",)
    assert environment == {"NEW": "2", "OTHER": "3"}
    assert rename_settings({"OLD": "2", "NEW": "2"}) == (note,)
    empty = {"OLD": "1", "NEW": ""}  # which counts as one that is not set
    assert (rename_settings(empty), empty) == ((note,), {"NEW": "1"})
    assert rename_settings(environment) == ()
