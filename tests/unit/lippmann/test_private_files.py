"""The files of a farm are closed to others, and a group that shares a farm keeps its rights."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from lippmann.private_files import close_parts, keep_private, make_passable

IS_ROOT = os.geteuid() == 0


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


@pytest.mark.parametrize(("before", "after"), [(0o022, 0o077), (0o002, 0o007), (0o077, 0o077), (0o027, 0o077)])
def test_the_umask_leaves_others_nothing_and_the_group_what_it_may_write(before: int, after: int) -> None:
    was = os.umask(before)
    try:
        keep_private()
    finally:
        now = os.umask(was)
    assert now == after


def test_only_root_makes_folders_that_others_may_pass_and_nobody_makes_some_that_they_list(tmp_path: Path) -> None:
    was = os.umask(0o077)
    try:
        make_passable(tmp_path / "a" / "b")
        make_passable(tmp_path / "a" / "b")
    finally:
        os.umask(was)
    expected = 0o711 if IS_ROOT else 0o700
    assert [mode(tmp_path / name) for name in ("a", "a/b")] == [expected] * 2


def test_the_folders_of_an_earlier_version_are_closed_and_those_beside_them_stay(tmp_path: Path) -> None:
    for name in ("artifacts", "scratch", "mine"):
        (tmp_path / name).mkdir()
        (tmp_path / name).chmod(0o755)
    close_parts(tmp_path)
    assert {path.name: mode(path) for path in tmp_path.iterdir()} == {
        "artifacts": 0o750, "scratch": 0o751 if IS_ROOT else 0o750, "mine": 0o755,
    }  # fmt: skip
