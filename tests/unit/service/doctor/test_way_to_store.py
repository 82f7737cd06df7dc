"""What the doctor says of a bucket beside a worker, which has no database."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import botocore.auth
import pytest

from service.doctor.finding import Check, Level
from service.doctor.store import check_way_to_store
from tests.object_store import ObjectStore
from tests.object_store import object_store as object_store
from worker.store.s3 import S3Store


@pytest.fixture
def make_store(object_store: ObjectStore, tmp_path: Path) -> Callable[..., S3Store]:
    bucket = object_store.new_bucket()
    return lambda **change: S3Store(
        **{"bucket": bucket, "copies": tmp_path, "endpoint": object_store.endpoint, "attempts": 1, **change}
    )


def found(store: S3Store) -> tuple[Level, str]:
    (finding,) = check_way_to_store(store)
    assert finding.check is Check.STORE
    return finding.level, finding.message


def test_a_bucket_of_a_farm_takes_artifacts_and_keeps_none_of_the_doctor(make_store: Callable[..., S3Store]) -> None:
    identity = make_store().make_identity()
    assert found(make_store()) == (Level.NOTE, f"the store takes artifacts, and has the id {identity}")
    assert make_store().list("") == []


def test_a_bucket_without_an_id_is_that_of_no_farm_and_is_not_written_to(make_store: Callable[..., S3Store]) -> None:
    level, message = found(make_store())
    assert (level, "it is not that of a farm" in message) == (Level.WARNING, True)
    assert make_store().list("") == []


@pytest.mark.parametrize(
    ("variable", "value", "reason"),
    [
        ("AWS_ACCESS_KEY_ID", "nobody", "the server does not know the access key"),
        ("AWS_SECRET_ACCESS_KEY", "wrong-secret", "the secret key is not that of the access key"),
    ],
)
def test_a_wrong_key_is_named(
    make_store: Callable[..., S3Store], monkeypatch: pytest.MonkeyPatch, variable: str, value: str, reason: str
) -> None:
    monkeypatch.setenv(variable, value)
    level, message = found(make_store())
    assert (level, reason in message, value in message) == (Level.ERROR, True, False)


def test_a_wrong_bucket_is_named(make_store: Callable[..., S3Store]) -> None:
    level, message = found(make_store(bucket="no-such-bucket"))
    assert (level, "bucket no-such-bucket at" in message) == (Level.ERROR, True)
    assert "the server has no bucket of this name" in message


def test_a_wrong_clock_is_named_with_the_difference(
    make_store: Callable[..., S3Store], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = botocore.auth.get_current_datetime
    late = datetime.timedelta(hours=2)
    monkeypatch.setattr(botocore.auth, "get_current_datetime", lambda *a, **k: now(*a, **k) - late)
    level, message = found(make_store())
    assert (level, "the clock of this machine differs from that of the server" in message) == (Level.ERROR, True)
