"""The process that started a supervisor receives its events."""

from __future__ import annotations

import errno
import json
import subprocess
from collections.abc import Mapping
from typing import Any

import pytest

from lippmann.errors import FarmFailed
from lippmann.farm.supervisor.farm import Farm
from tests.waiting import until


@pytest.mark.parametrize("error", [BrokenPipeError(), OSError(errno.EIO, "no terminal"), ValueError("closed file")])
def test_a_farm_comes_up_and_its_end_is_noticed_where_nobody_reads_its_notes(error: Exception) -> None:
    told: list[str] = []

    def tell(event: Mapping[str, Any]) -> None:
        told.append(event["event"])
        raise error

    events = [{"event": "child_ready", "child": "broker"}, {"event": "ready", "url": "http://127.0.0.1:1", "key": "k"}]
    lines = "".join(f"{json.dumps(event)}\n" for event in events)
    command = ["sh", "-c", 'printf %s "$0"; read word', lines]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as supervisor:
        farm = Farm(supervisor, tell)
        until(lambda: farm.address.url)
        farm.wait_until_up()
        supervisor.kill()
        with pytest.raises(FarmFailed, match="the farm ended by itself"):
            farm.wait()
    assert told == ["child_ready"]
