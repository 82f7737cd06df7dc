"""The limits of the form for a new job are those of the service."""

from __future__ import annotations

import re

from lippmann.untrusted.zip_archive import MAX_BYTES, MAX_FILES
from service.dashboard.assets import assets


def test_the_page_and_the_service_have_the_same_limits_of_a_scene() -> None:
    text = assets()["new-job/scenes/dropped.js"].body.decode()
    found = {name: int(number) for name, number in re.findall(r"^const (MOST_\w+) = (\d+);", text, re.MULTILINE)}
    assert found == {"MOST_FILES": MAX_FILES, "MOST_MIB": MAX_BYTES // 2**20}
