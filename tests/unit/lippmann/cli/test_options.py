"""Options that several commands share."""

from __future__ import annotations

import re

import pytest
from typer.testing import CliRunner

from lippmann.cli import main
from lippmann.errors import BadInput


@pytest.mark.parametrize(
    "arguments",
    [
        ["keys", "create", "ann", "--days", "inf"],
        ["keys", "create", "ann", "--limit", "open_jobs=inf"],
        ["keys", "create", "ann", "--limit", "open_jobs=nan"],
        ["link", "job", "video/views.mp4", "--hours", "inf"],
    ],
)
def test_an_infinite_number_is_refused_before_a_service_is_asked(arguments: list[str]) -> None:
    ran = CliRunner().invoke(main.app, [*arguments, "--url", "http://127.0.0.1:1", "--key", "k"])
    assert isinstance(ran.exception, BadInput)
    assert re.match(r"--(days|hours): expected a finite number, got |--limit: expected NAME=", ran.exception.message)
