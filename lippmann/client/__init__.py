"""The Python client of the service.

client     jobs, scenes, files, keys: `Client`
errors     what the service refuses
stream     server-sent events, from lines
transport  HTTP, only here: keys, repeats, problems, downloads that go on where they stopped
"""

from __future__ import annotations

from lippmann.client.client import Client
from lippmann.client.errors import Refused
from lippmann.client.stream import ServerEvent
from lippmann.client.transport import Download

__all__ = ["Client", "Download", "Refused", "ServerEvent"]
