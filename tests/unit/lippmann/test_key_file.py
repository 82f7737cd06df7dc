"""The file of the keys of messages: who may read it, what it holds, and when it is read again."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from lippmann.errors import BadInput
from lippmann.key_file import MAX_KEYS, KeyFile, read_keys

OLD, NEW = "1" * 64, "a" * 64


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "new" / "order.key"


def write(path: Path, text: str, mode: int = 0o600) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(mode)


def test_a_new_key_is_for_its_user_only_and_is_made_once(path: Path) -> None:
    file = KeyFile(path)
    assert file.keys() == ()
    file.ensure()
    (key,) = file.keys()
    KeyFile(path).ensure()
    assert KeyFile(path).keys() == (key,)
    assert len(key) == 32
    assert path.stat().st_mode & 0o777 == 0o600
    assert list(path.parent.iterdir()) == [path]


def test_the_first_key_signs_and_a_change_needs_no_restart(path: Path) -> None:
    write(path, f"{OLD}\n")
    file = KeyFile(path)
    assert file.keys() == (bytes.fromhex(OLD),)
    write(path, f"# of 2026\n{NEW}  # signs\n\n{OLD}\n")
    assert file.keys() == (bytes.fromhex(NEW), bytes.fromhex(OLD))


def test_a_file_that_vanishes_or_breaks_leaves_the_keys_that_were_read(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write(path, OLD)
    file = KeyFile(path)
    known = file.keys()
    with caplog.at_level(logging.WARNING):
        write(path, "nonsense")
        assert file.keys() == known
        assert file.keys() == known
    assert len(caplog.records) == 1
    path.unlink()
    assert file.keys() == known


@pytest.mark.promise("Between processes", "A key file that others may read is refused.")
@pytest.mark.parametrize("mode", [0o604, 0o620, 0o644, 0o666])
def test_a_file_that_others_may_read_is_refused(path: Path, mode: int) -> None:
    write(path, OLD, mode)
    with pytest.raises(BadInput, match=f"{mode:04o}"):
        KeyFile(path).keys()


def test_a_secret_that_the_group_may_read_is_accepted(path: Path) -> None:
    write(path, OLD, 0o440)
    assert read_keys(path) == (bytes.fromhex(OLD),)


@pytest.mark.parametrize(
    "text", ["", "# none\n", "12", OLD[:-2], OLD + "aa", "g" * 64, "é" * 64, f"{OLD}\n" * (MAX_KEYS + 1)]
)
def test_a_file_without_proper_keys_is_refused(path: Path, text: str) -> None:
    write(path, text)
    with pytest.raises(BadInput, match=r"64 hexadecimal digits|1 to 16 keys"):
        read_keys(path)
