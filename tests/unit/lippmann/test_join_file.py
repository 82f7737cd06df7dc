"""Join files: written once, readable by one user, and refused with the name of what is wrong."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from lippmann.errors import BadInput
from lippmann.join_file import (
    MAX_JOIN_BYTES,
    JoinBroker,
    JoinFile,
    JoinKey,
    JoinStore,
    check_absent,
    join_text,
    read_access_keys,
    read_join_file,
    write_join_file,
)
from tests.authority import Authority

NOW = datetime(2027, 1, 1, tzinfo=UTC)
SECRET = "s" * 43
JOIN = JoinFile(
    farm="https://farm.example", release="0.1.0", order_keys=("ab" * 32, "cd" * 32),
    worker=JoinKey(id="00112233aabb", secret=SECRET, name="Räckså \"1\"", expires_at=datetime(2027, 6, 1, tzinfo=UTC)),
    broker=JoinBroker(url="rediss://broker.example:6379/0", user="lippmann-worker", password="a/b'\"\\c"),
    store=JoinStore(
        url="s3://farm/lippmann", endpoint="https://s3.example:8333", access_key="AK", secret_key="SK"
    ),
)  # fmt: skip


def written(folder: Path, text: str) -> Path:
    path = folder / "join.toml"
    path.touch(0o600)
    path.write_text(text)
    return path


def test_a_join_file_is_read_as_it_was_written_and_is_its_users_alone(tmp_path: Path) -> None:
    ca = Authority(tmp_path).ca_file.read_text()
    join = JOIN.model_copy(update={"broker": JOIN.broker.model_copy(update={"ca": ca + ca})})
    write_join_file(tmp_path / "join.toml", join)
    assert (tmp_path / "join.toml").stat().st_mode & 0o777 == 0o600
    assert read_join_file(tmp_path / "join.toml", now=NOW) == join


def test_a_file_that_exists_is_never_replaced(tmp_path: Path) -> None:
    path = written(tmp_path, "mine")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for existing in (path, tmp_path / "link"):
        with pytest.raises(BadInput, match="does not exist yet"):
            write_join_file(existing, JOIN)
        with pytest.raises(BadInput, match="does not exist yet"):
            check_absent(existing)
    assert path.read_text() == "mine"
    with pytest.raises(BadInput, match="folder that exists"):
        check_absent(tmp_path / "no" / "join.toml")


@pytest.mark.promise("Between processes", "A join file that others may read is refused.")
def test_a_file_that_others_may_read_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, join_text(JOIN))
    path.chmod(0o604)
    with pytest.raises(BadInput, match=r"join file that only its user may read .* mode 0604"):
        read_join_file(path, now=NOW)


def test_an_expired_file_says_when_it_expired(tmp_path: Path) -> None:
    path = written(tmp_path, join_text(JOIN))
    with pytest.raises(BadInput, match=r"worker\.expires_at: the worker key 00112233aabb expired at 2027-06-01T00"):
        read_join_file(path, now=datetime(2027, 6, 1, 0, 0, 1, tzinfo=UTC))


@pytest.mark.parametrize(
    ("was", "becomes", "named"),
    [
        ("format = 1", "format = 2", "format: expected 1, the one that this release reads, got 2"),
        ("format = 1", "", "format: expected 1, the one that this release reads, got None"),
        ("[store]", "[store", "expected a join file, which is TOML"),
        ("[store]", "[shop]", "store: Field required"),
        ('release = "0.1.0"', 'release = "0.1.0"\ncolour = "red"', "colour: Extra inputs"),
        (SECRET, "short", "worker.secret: String should have at least 32"),
        ('id = "00112233aabb"', 'id = "../../etc"', "worker.id: String should match"),
        ("rediss://broker", "http://broker", "broker.url: expected redis://HOST:PORT/0"),
        ("rediss://broker", "rediss://user:word@broker", "broker.url: expected redis://HOST:PORT/0"),
        ("s3://farm/lippmann", "file:///etc", "store.url: String should match"),
        ("2027-06-01T00:00:00Z", "2027-06-01T00:00:00", "worker.expires_at: expected a time with its zone"),
        ("ab" * 32, "ab" * 31, "order_keys.0: String should match"),
        ('endpoint = "https', 'endpoint = "ftp', "store.endpoint: String should match"),
        ("[store]", 'ca = "no"\n[store]', "broker.ca: "),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_without_a_secret(tmp_path: Path, was: str, becomes: str, named: str) -> None:
    text = join_text(JOIN).replace('ca = ""\n', "")
    assert was in text
    with pytest.raises(BadInput) as refused:
        read_join_file(written(tmp_path, text.replace(was, becomes, 1)), now=NOW)
    assert named in refused.value.message
    assert not any(secret in refused.value.message for secret in (SECRET, "ab" * 31, "a/b", "word@"))


@pytest.mark.parametrize("data", [b"\xff\xfe", b"x" * (MAX_JOIN_BYTES + 1), b"a=" + b"[" * 100_000, b""])
def test_what_is_no_join_file_is_refused(tmp_path: Path, data: bytes) -> None:
    path = written(tmp_path, "")
    path.write_bytes(data)
    with pytest.raises(BadInput, match=r"join\.toml: "):
        read_join_file(path, now=NOW)


def test_access_keys_are_read_as_aws_writes_them(tmp_path: Path) -> None:
    path = written(tmp_path, "[default]\naws_access_key_id = AK\naws_secret_access_key = S%K\n")
    assert read_access_keys(path) == ("AK", "S%K")
    path.write_text(path.read_text() + "aws_session_token = t\n")
    with pytest.raises(BadInput, match="temporary"):
        read_access_keys(path)
    path.write_text("AK:SK")
    with pytest.raises(BadInput, match="aws_access_key_id"):
        read_access_keys(path)
