"""The log of an attempt can be read while the attempt runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builders_service import DictStore
from tests.waiting import until
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.live_log import stored_while_it_grows

NAME = "01h/log/render-0001/1.txt"


def test_a_log_is_stored_while_it_grows(tmp_path: Path) -> None:
    store, path = DictStore(), tmp_path / "log.txt"
    with AttemptLog(path) as log, stored_while_it_grows(store, NAME, path, first_s=0.01):
        log.write("Parsing")
        until(lambda: store.files.get(NAME) == b"Parsing\n")
        log.write("Rendering")
        until(lambda: store.files.get(NAME) == b"Parsing\nRendering\n")


def test_a_store_that_is_away_ends_neither_the_attempt_nor_the_copies(tmp_path: Path) -> None:
    store, path = DictStore(away=True), tmp_path / "log.txt"
    with AttemptLog(path) as log, stored_while_it_grows(store, NAME, path, first_s=0.01) as thread:
        log.write("Parsing")
        with pytest.raises(AssertionError):
            until(lambda: NAME in store.files, within_s=0.2)
        store.away = False
        until(lambda: NAME in store.files)
        assert thread.is_alive()
    assert not thread.is_alive()
