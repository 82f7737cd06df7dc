"""The Python client of the service: `from lippmann import Client`.

client        jobs, scenes, files and keys of a service
connection    the service that a command works with
address       where the service is, and the key to it
transport     HTTP: keys, retries, problem details, resumed downloads
http_client   a client of the HTTP library, with the proxies of the environment
direct        downloads from the server of the store
partial_file  the temporary file of a download
stream        server-sent events
errors        refusals of the service
watch         watch a job until it ends
logs          the logs of the tasks of a job, also as they come
fetch         download the files of a job
fetch_record  the job and the files of a folder
missing       what a fetch could not bring, and why
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lippmann.client.client import Client
    from lippmann.client.errors import KeyRefused, Refused
    from lippmann.client.stream import ServerEvent

__all__ = ["Client", "KeyRefused", "Refused", "ServerEvent"]


def __getattr__(name: str) -> Any:
    # A class is imported on first use, so that `lippmann --help` does not load the HTTP library.
    from importlib import import_module

    home = {"Client": "client", "KeyRefused": "errors", "Refused": "errors", "ServerEvent": "stream"}.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"lippmann.client.{home}"), name)
