"""The short form of the fuzz; `make fuzz` runs the long one."""

from __future__ import annotations

import pytest

from tests.security.fuzz import fuzz
from tests.security.readers import READERS, job_bytes, request_reader

SEED = 20261129


@pytest.mark.promise("Scenes", "A reader of foreign text returns or refuses, whatever it is given.")
@pytest.mark.parametrize("name", READERS)
def test_a_reader_returns_or_refuses(name: str) -> None:
    report = fuzz(name, *READERS[name], inputs=200, seed=SEED)
    assert not report.findings
    assert 0 < report.accepted < report.inputs, "the inputs are neither all valid nor all invalid"


def test_a_request_is_never_a_fault_of_the_service() -> None:
    with request_reader() as read:
        assert not fuzz("request", job_bytes, read, inputs=100, seed=SEED).findings


def test_a_fault_of_a_reader_is_found() -> None:
    def read(data: bytes) -> object:
        return 1 / (len(data) % 3)

    report = fuzz("job", job_bytes, read, inputs=50, seed=SEED)
    assert "ZeroDivisionError" in report.findings[0]
