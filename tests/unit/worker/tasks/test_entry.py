"""A worker that is ready sweeps in threads, so that a slow disk or store does not hold it up."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from tests.waiting import ENOUGH_S, until
from worker.settings import WorkerSettings
from worker.tasks import entry

RETURNS_S = 60.0
"""The time in which a call returns that waits for nothing, on a machine that does much else."""


class SilentStore:
    """A store whose server accepts connections and says nothing until it is told to."""

    def __init__(self) -> None:
        self.is_asked = threading.Event()
        self.may_answer = threading.Event()

    def identity(self) -> str | None:
        """Wait for the server."""
        self.is_asked.set()
        self.may_answer.wait(ENOUGH_S)
        return "0123"


def test_a_server_of_the_store_that_is_silent_does_not_hold_up_the_start_of_a_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, settings = SilentStore(), WorkerSettings(data_dir=tmp_path, store_url="s3://bucket")
    monkeypatch.setattr(entry, "settings", settings)
    monkeypatch.setattr(entry, "open_store", lambda _: store)
    left = settings.attempts_dir / "left"
    left.mkdir(parents=True)
    is_ready = threading.Thread(target=entry._sweep, daemon=True)
    is_ready.start()
    try:
        assert store.is_asked.wait(ENOUGH_S)
        is_ready.join(RETURNS_S)
        assert not is_ready.is_alive()
        until(lambda: not left.exists())
        assert all(thread.daemon for thread in threading.enumerate() if thread.name.startswith("sweep"))
    finally:
        store.may_answer.set()
