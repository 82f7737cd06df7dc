"""The clients of an S3 server: each process has its own, since connections are not shared after a fork.

Access keys come from where every program for S3 finds them: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, the file that
AWS_SHARED_CREDENTIALS_FILE names, or the role of the machine.
"""

from __future__ import annotations

import encodings.idna  # noqa: F401
import os
from typing import Any

import boto3

# The first client would import this, and the first connection `encodings.idna`. A process that is forked while a thread
# imports them could never do so.
import boto3.s3.inject
from botocore.config import Config

_SIGNING = Config(signature_version="s3v4")
"""Otherwise some URLs would be signed in an old way, which many servers do not know."""


class S3Clients:
    """The clients of this process.

    Parameters
    ----------
    endpoint, public_endpoint
        The URLs of the server for the farm and for its users; None for Amazon's.
    region
        The region of the bucket; None for that of the settings of the machine.
    """

    def __init__(self, endpoint: str | None, public_endpoint: str | None, region: str | None, config: Config) -> None:
        self._endpoint = endpoint
        self._public_endpoint = public_endpoint
        self._region = region
        self._config = config
        self._connecting: dict[int, Any] = {}
        self._signing: dict[int, Any] = {}

    @property
    def connecting(self) -> Any:
        """The client that sends requests."""
        # Without a lock, which a process may inherit locked: two threads that make a client at once do no harm.
        client = self._connecting.get(os.getpid())
        if client is None:
            client = self._new(self._endpoint, self._config)
            self._connecting = {os.getpid(): client}
        return client

    @property
    def signing(self) -> Any:
        """The client that signs URLs of the server as users see it; it never connects."""
        client = self._signing.get(os.getpid())
        if client is None:
            client = self._new(self._public_endpoint, self._config.merge(_SIGNING))
            self._signing = {os.getpid(): client}
        return client

    def _new(self, endpoint: str | None, config: Config) -> Any:
        session = boto3.session.Session()
        region = self._region or session.region_name or "us-east-1"
        return session.client("s3", endpoint_url=endpoint, region_name=region, config=config)
