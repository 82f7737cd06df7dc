"""Open the artifact store that the settings name. The kinds of stores are chosen here only."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

from lippmann.broker_settings import BrokerSettings
from lippmann.errors import BadInput
from lippmann.plan.artifact_store import ArtifactStore
from worker.store.local import LocalStore

ARTIFACTS = "artifacts"
"""The folder of the artifacts below the data folder; the service and the workers use the same one."""


COPIES = "scratch/copies"
"""The folder below the data folder for copies of the artifacts of a bucket. The room of a worker's scratch folder is
checked before each attempt, and in a container a worker writes there and nowhere else."""


def open_store(settings: BrokerSettings, *, reserve_bytes: int = 0, public_endpoint: str = "") -> ArtifactStore:
    """Return the store of a farm: the bucket of `store_url`, or the folder `artifacts` of the data folder.

    Parameters
    ----------
    reserve_bytes
        The free space of a disk that artifacts leave, bytes; a bucket has no such limit.
    public_endpoint
        The URL of the S3 server for clients of the farm; if empty, that of the farm.

    Raises
    ------
    BadInput
        If the store is a bucket and boto3 is not installed.
    """
    if not settings.store_url:
        return local_store(settings.data_dir, reserve_bytes=reserve_bytes)
    try:
        from worker.store.s3 import S3Store
    except ImportError as error:
        raise BadInput(
            f"LIPPMANN_STORE_URL: expected the extra `s3` of the package to be installed, got no {error.name}"
        ) from error
    url = urlsplit(settings.store_url)
    return S3Store(
        url.netloc, copies=settings.data_dir / COPIES, prefix=url.path.strip("/"), endpoint=settings.s3_endpoint,
        public_endpoint=public_endpoint, region=settings.s3_region,
    )  # fmt: skip


def local_store(data_dir: Path, *, reserve_bytes: int = 0) -> LocalStore:
    """Return the store in the folder `artifacts` of a data folder."""
    return LocalStore(data_dir / ARTIFACTS, reserve_bytes=reserve_bytes)
