"""A worker beside a service of another user."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from lippmann.errors import StoreUnavailable
from lippmann.private_files import keep_private
from worker.store.owner import check_owner

SERVICE = 65_533
"""A user without a name."""

only_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root is a worker that may write for every service")


@pytest.fixture
def umask() -> Iterator[None]:
    """Restore the umask, which a test changes."""
    was = os.umask(0o022)
    yield
    os.umask(was)


def store_of(folder: Path, user: int, *, mode: int = 0o700, group: int = 0) -> Path:
    """Return a store that belongs to a user."""
    store = folder / "artifacts"
    store.mkdir()
    os.chown(store, user, group)
    store.chmod(mode)
    return store


@only_root
@pytest.mark.promise("Between processes", "A worker whose files the service could not read does not start.")
def test_a_worker_of_root_is_refused_beside_a_service_of_another_user(tmp_path: Path, umask: None) -> None:
    keep_private()
    store = store_of(tmp_path, SERVICE)
    with pytest.raises(StoreUnavailable, match=r"expected a worker of the user 65533, .* got one of the user root"):
        check_owner(store)
    assert list(store.iterdir()) == []


@only_root
def test_a_group_of_both_is_enough(tmp_path: Path, umask: None) -> None:
    store = store_of(tmp_path, SERVICE, mode=0o2770, group=SERVICE)
    os.umask(0o002)
    keep_private()
    check_owner(store)
    os.umask(0o022)
    keep_private()
    with pytest.raises(StoreUnavailable, match="umask 002"):
        check_owner(store)


def test_the_user_of_the_service_is_always_right(tmp_path: Path, umask: None) -> None:
    keep_private()
    check_owner(store_of(tmp_path, os.geteuid(), group=os.getegid()))
    check_owner(tmp_path / "not there yet")
