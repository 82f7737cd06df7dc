"""The check of a folder before minutes of work."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from lippmann.errors import BadInput
from lippmann.local.files.writable import check_writable


def test_a_folder_that_is_missing_is_made_and_nothing_stays_in_it(tmp_path: Path) -> None:
    check_writable(tmp_path / "a/b")
    assert not list((tmp_path / "a/b").iterdir())


def test_many_may_check_the_same_folder_at_the_same_time(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(check_writable, [tmp_path] * 400))


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match=r"expected a folder that can be written, got .*/file/inside: "):
        check_writable(tmp_path / "file/inside")
