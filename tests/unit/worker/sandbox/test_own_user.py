"""A user of its own for a program, and what is given to it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from worker.sandbox import own_user as module
from worker.sandbox.detect import trial
from worker.sandbox.own_user import USERS, hand_over, is_open_to_all, let_read, own_user
from worker.sandbox.sandbox import Sandbox, SandboxMode

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files to others")


@needs_root
def test_programs_in_different_folders_have_different_users(tmp_path: Path) -> None:
    found = {own_user(tmp_path / str(number)) for number in range(50)}
    assert len(found) > 45
    assert all(user in USERS for user in found if user is not None)


def test_who_is_not_root_has_no_other_user(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert own_user(tmp_path) is None


@pytest.mark.parametrize(
    ("mapping", "is_mapped"), [("0 0 4294967295", True), ("0 1000 1\n1 100000 65535", True), ("0 0 1", False)]
)
def test_a_container_in_which_the_users_do_not_exist_is_noticed(mapping: str, is_mapped: bool, tmp_path: Path) -> None:
    (tmp_path / "uid_map").write_text(mapping)
    assert module._is_mapped(tmp_path / "uid_map") is is_mapped


@needs_root
def test_a_folder_is_handed_over_with_its_files_and_no_link_is_followed(tmp_path: Path) -> None:
    outside, inside = tmp_path / "outside", tmp_path / "task"
    outside.write_text("")
    (inside / "deep").mkdir(parents=True)
    (inside / "deep" / "file").write_text("")
    (inside / "link").symlink_to(outside)
    hand_over(inside, USERS.start)
    owned = [inside, inside / "deep", inside / "deep" / "file", inside / "link"]
    assert {path.lstat().st_uid for path in owned} == {USERS.start}
    assert outside.stat().st_uid == 0


@needs_root
def test_a_closed_folder_can_be_read_by_the_user_and_still_by_nobody_else(tmp_path: Path) -> None:
    closed, outside = tmp_path / "closed", tmp_path / "outside"
    closed.mkdir(mode=0o700)
    outside.write_text("")
    outside.chmod(0o600)
    (closed / "scene.pov").write_text("")
    (closed / "link").symlink_to(outside)
    let_read(closed, USERS.start)
    assert [path.stat().st_gid for path in (closed, closed / "scene.pov", outside)] == [USERS.start, USERS.start, 0]
    assert [path.stat().st_mode & 0o777 for path in (closed, closed / "scene.pov", outside)] == [0o750, 0o640, 0o600]


@needs_root
def test_a_folder_that_is_open_to_others_stays_as_it_is(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    let_read(tmp_path, USERS.start)
    assert (tmp_path.stat().st_gid, tmp_path.stat().st_mode & 0o777) == (os.getgid(), 0o755)


def test_a_folder_below_a_closed_one_is_not_open_to_all(tmp_path: Path) -> None:
    (tmp_path / "closed" / "task").mkdir(parents=True)
    (tmp_path / "closed").chmod(0o700)
    above = [tmp_path, *tmp_path.parents[:-1]]
    closed = any(folder.stat().st_mode & 1 == 0 for folder in above)
    assert not is_open_to_all([tmp_path / "closed" / "task"])
    assert is_open_to_all([tmp_path / "closed", tmp_path / "closed" / "task"]) is not closed


@pytest.mark.parametrize("mode", ["bwrap", "landlock"])
def test_a_sandbox_holds_whatever_the_umask_of_the_worker(mode: SandboxMode) -> None:
    before = trial(Sandbox(mode))
    was = os.umask(0o077)
    try:
        assert trial(Sandbox(mode)) == before
    finally:
        os.umask(was)
