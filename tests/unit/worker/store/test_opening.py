"""The store that the settings name."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from lippmann.broker_settings import BrokerSettings
from lippmann.errors import BadInput
from tests.object_store import ObjectStore
from worker.settings import WorkerSettings
from worker.store.local import LocalStore
from worker.store.opening import COPIES, open_store
from worker.store.s3 import S3Store


def test_without_a_url_the_store_is_a_folder(tmp_path: Path) -> None:
    assert isinstance(open_store(BrokerSettings(data_dir=tmp_path)), LocalStore)
    assert (tmp_path / "artifacts").is_dir()


def test_a_url_names_a_bucket_and_a_prefix(object_store: ObjectStore, tmp_path: Path) -> None:
    bucket = object_store.new_bucket()
    settings = WorkerSettings(data_dir=tmp_path, store_url=f"s3://{bucket}/a/b", s3_endpoint=object_store.endpoint)
    store = open_store(settings)
    assert isinstance(store, S3Store)
    store.put_bytes("job/a", b"data")
    found = object_store.client().list_objects_v2(Bucket=bucket)["Contents"]
    assert [entry["Key"] for entry in found] == ["a/b/job/a"]
    with store.local_path("job/a") as path:
        # In a container, a worker writes in its scratch folder and nowhere else.
        assert path.is_relative_to(settings.scratch_dir)
    assert (tmp_path / COPIES).is_relative_to(settings.scratch_dir)


@pytest.mark.parametrize("url", ["s3://", "s3://A_B", "http://bucket", "bucket", "s3://bucket//x", "s3://bucket/../x"])
def test_a_url_that_names_no_bucket_is_refused(tmp_path: Path, url: str) -> None:
    with pytest.raises(BadInput, match="expected s3://bucket or s3://bucket/prefix, got"):
        BrokerSettings(data_dir=tmp_path, store_url=url)


def test_without_boto3_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith(("boto3.", "worker.store.s3"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "boto3", None)
    with pytest.raises(BadInput, match="LIPPMANN_STORE_URL: expected the extra `s3` of the package to be installed"):
        open_store(BrokerSettings(data_dir=tmp_path, store_url="s3://bucket"))
