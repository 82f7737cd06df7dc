"""What a worker says of itself comes from variables, and what it cannot be is refused with the name of the variable."""

from __future__ import annotations

import os

import pytest

from lippmann.cli.commands.farms.farm import _set_profile
from lippmann.errors import BadInput
from worker.settings import WorkerSettings

NAMES = ("LIPPMANN_WORKER_POOL", "LIPPMANN_WORKER_TAGS", "LIPPMANN_WORKER_HOURS")


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES:
        monkeypatch.setenv(name, "")  # so that what a test sets is undone


def test_pool_tags_and_hours_come_from_the_environment_and_options_count_more(monkeypatch: pytest.MonkeyPatch) -> None:
    found = WorkerSettings()
    assert (found.worker_pool, found.worker_tags, found.worker_hours) == ("", (), None)
    monkeypatch.setenv("LIPPMANN_WORKER_POOL", "day")
    monkeypatch.setenv("LIPPMANN_WORKER_TAGS", "fast-disk, big,")
    monkeypatch.setenv("LIPPMANN_WORKER_HOURS", "Mon-Fri 19:00-07:00")
    _set_profile(None, None)
    found = WorkerSettings()
    assert (found.worker_pool, found.worker_tags) == ("day", ("fast-disk", "big"))
    assert found.worker_hours is not None
    assert len(found.worker_hours.spans) == 5
    _set_profile("night", ["gpu", "big"])
    found = WorkerSettings()
    assert (found.worker_pool, found.worker_tags) == ("night", ("gpu", "big"))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("LIPPMANN_WORKER_POOL", "Night shift", "LIPPMANN_WORKER_POOL: .*got 'Night shift'"),
        ("LIPPMANN_WORKER_TAGS", "gpu,GPU 2", "LIPPMANN_WORKER_TAGS: "),
        ("LIPPMANN_WORKER_TAGS", ",".join("abcdefghijk"), "LIPPMANN_WORKER_TAGS: .*at most 10"),
        ("LIPPMANN_WORKER_HOURS", "at night", "LIPPMANN_WORKER_HOURS: expected hours such as `Mon-Fri 19:00-07:00"),
    ],
)
def test_a_value_that_is_invalid_is_refused_with_its_variable(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, message: str
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(BadInput, match=message):
        _set_profile(None, None)
    assert os.environ[name] == value


@pytest.mark.parametrize("name", ["LIPPMANN_S3_ENDPOINT", "LIPPMANN_STORE_URL", "LIPPMANN_SLOTS"])
def test_an_invalid_value_that_may_have_a_password_is_not_repeated(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setenv(name, "https://me:hunter2@s3 example")
    with pytest.raises(BadInput, match=f"^{name}: .*, got another value$") as refused:
        _set_profile(None, None)
    assert "hunter2" not in refused.value.message
