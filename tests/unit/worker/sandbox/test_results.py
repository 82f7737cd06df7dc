"""What a program leaves behind: only what was asked for is taken, and no link is followed."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from lippmann.errors import RenderFailed
from worker.sandbox.results import fresh_folder, remove_tree, take_result

SECRET = b"the key of the administrator"


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Return the folder that a program could write and one that it could not; a secret is beside both."""
    (tmp_path / "secret").write_bytes(SECRET)
    work, ours = tmp_path / "work", tmp_path / "ours"
    work.mkdir()
    ours.mkdir()
    return work, ours


def test_the_file_that_was_asked_for_is_moved_and_nothing_else(folders: tuple[Path, Path]) -> None:
    work, ours = folders
    (work / "tile.exr").write_bytes(b"picture")
    (work / "other").write_bytes(b"other")
    assert take_result(work, "tile.exr", into=ours, max_bytes=7) == ours / "tile.exr"
    assert [path.name for path in ours.iterdir()] == ["tile.exr"]
    assert (ours / "tile.exr").read_bytes() == b"picture"
    assert take_result(work, "tile.exr", into=ours, max_bytes=7) is None


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


LEFT: dict[str, tuple[Callable[[Path], object], str]] = {
    "a link to a secret": (lambda path: path.symlink_to("../secret"), "a symbolic link"),
    "a link to nothing": (lambda path: path.symlink_to("../not-there"), "a symbolic link"),
    "a second name of a secret": (lambda path: path.hardlink_to(path.parent.parent / "secret"), "2 names"),
    "a named pipe": (os.mkfifo, "a named pipe"),
    "a folder": (Path.mkdir, "a folder"),
    "a socket": (_socket, "a socket"),
    "too much": (lambda path: path.write_bytes(bytes(101)), "at most 100 bytes"),
}


@pytest.mark.parametrize("name", LEFT)
def test_anything_but_an_ordinary_file_is_refused(folders: tuple[Path, Path], name: str) -> None:
    work, ours = folders
    make, message = LEFT[name]
    make(work / "tile.exr")
    with pytest.raises(RenderFailed, match=message):
        take_result(work, "tile.exr", into=ours, max_bytes=100)
    assert list(ours.iterdir()) == []
    assert (work.parent / "secret").read_bytes() == SECRET


def test_a_folder_that_became_a_link_is_not_entered(folders: tuple[Path, Path]) -> None:
    work, ours = folders
    work.rmdir()
    work.symlink_to(work.parent)
    with pytest.raises(OSError, match="work"):
        take_result(work, "secret", into=ours, max_bytes=100)


def test_a_link_of_ours_is_replaced_and_not_written_through(folders: tuple[Path, Path]) -> None:
    work, ours = folders
    (work / "tile.exr").write_bytes(b"picture")
    (ours / "tile.exr").symlink_to("../secret")
    take_result(work, "tile.exr", into=ours, max_bytes=100)
    assert (ours / "tile.exr").read_bytes() == b"picture"
    assert (work.parent / "secret").read_bytes() == SECRET


def test_folders_of_any_depth_are_removed(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "file").write_text("")
    here = os.getcwd()
    with fresh_folder(tmp_path / "work") as work:
        (work / "link").symlink_to(outside)
        os.chdir(work)
        try:
            for _ in range(3000):
                os.mkdir("deeper")
                os.chdir("deeper")
        finally:
            os.chdir(here)
    assert not work.exists()
    assert (outside / "file").exists()


def test_a_link_in_the_place_of_a_folder_is_removed_and_not_its_target(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "work").symlink_to("kept")
    remove_tree(tmp_path / "work")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
    remove_tree(tmp_path / "work")
