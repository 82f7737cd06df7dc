"""A worker's place for tests that render with the real Mitsuba."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.builders import local_place
from tests.needs import missing
from worker.engines.choose import ENGINES
from worker.engines.mitsuba.version import Missing, mitsuba_version
from worker.tasks.attempts.workplace import Workplace


def lend_mitsuba_place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workplace]:
    """Lend a worker's place; the program of Mitsuba ends with the module. Modules make it their fixture."""
    found = mitsuba_version()
    if isinstance(found, Missing):
        missing(f"needs Mitsuba: {found.reason}")
    yield local_place(tmp_path_factory.mktemp("farm"))
    ENGINES["mitsuba"].end()
