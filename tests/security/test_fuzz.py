"""The short form of the fuzz; `make fuzz` runs the long one."""

from __future__ import annotations

import pytest

from tests.security.file_readers import DECODER, FILE_READERS
from tests.security.fuzz import DIRECT, fuzz
from tests.security.readers import READERS, job_bytes, request_reader
from tests.security.scene_readers import SCENE_READERS

SEED = 20261129
REFUSE_NOTHING = ("scene text", "output")
"""The readers that look for something in any text."""


@pytest.mark.promise("Scenes", "A reader of foreign text returns or refuses, whatever it is given.")
@pytest.mark.parametrize("name", [*READERS, *FILE_READERS, *SCENE_READERS])
def test_a_reader_returns_or_refuses(name: str) -> None:
    report = fuzz(name, *DIRECT[name], inputs=200 if name in READERS else 60, seed=SEED)
    assert not report.findings
    refused = report.inputs - report.accepted
    assert report.accepted > 0, "some inputs are valid"
    assert (refused == 0) == (name in REFUSE_NOTHING), "some inputs are invalid"


def test_the_decoder_of_pictures_returns_or_refuses() -> None:
    assert not fuzz("decoder", *DECODER, inputs=4, seed=SEED).findings


def test_a_request_is_never_a_fault_of_the_service() -> None:
    with request_reader() as read:
        assert not fuzz("request", job_bytes, read, inputs=100, seed=SEED).findings


def test_a_fault_of_a_reader_is_found() -> None:
    def read(data: bytes) -> object:
        return 1 / (len(data) % 3)

    report = fuzz("job", job_bytes, read, inputs=50, seed=SEED)
    assert "ZeroDivisionError" in report.findings[0]
