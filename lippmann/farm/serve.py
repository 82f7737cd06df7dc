"""The service as a process."""

from __future__ import annotations

import logging
import signal
import socket
import sys
import time
from pathlib import Path
from typing import TextIO, cast

from lippmann.client.address import write_private
from lippmann.farm.adapters import make_parts
from lippmann.farm.listening import url_of
from lippmann.farm.log_file import LogFile
from lippmann.farm.supervisor.children import SERVICE_READY
from lippmann.logs import configure_logs
from service import auth as keys
from service.db.engine import opened
from service.db.migrations import migrate
from service.db.tables import ADMIN_OWNER
from service.main import Server, create_app
from service.schemas.access import Role
from service.settings import Settings
from worker.store.opening import open_store

log = logging.getLogger(__name__)


class _Announcing(Server):
    """A server that prints a line when it accepts requests."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        if self.started and sockets:
            print(f"{SERVICE_READY} on {url_of(sockets[0])}", file=sys.stderr, flush=True)


def run_service(settings: Settings, listening: socket.socket, *, key_file: Path | None) -> bool:
    """Serve until the process is stopped; return whether the service started.

    Parameters
    ----------
    listening
        A socket that was bound before anything else was started.
    key_file
        The file for an admin key of this service. It is written if it does not exist or its key is not known.
    """
    _log_to_stderr(settings)
    if key_file is not None:
        keep_admin_key(settings, key_file)
    store = open_store(settings, reserve_bytes=settings.disk_reserve_bytes, public_endpoint=settings.s3_public_endpoint)
    app = create_app(settings, make_parts(store))
    server = _Announcing(app, host=settings.host, port=settings.port)
    for number in (signal.SIGINT, signal.SIGTERM):
        # uvicorn raises these signals again after it has stopped in order; by then nothing is left to stop.
        signal.signal(number, lambda *_: None)
    server.run(sockets=[listening])
    return server.started


def _log_to_stderr(settings: Settings) -> None:
    configure_logs(cast(TextIO, LogFile(sys.stderr)), log_format=settings.log_format)
    logging.getLogger("uvicorn.access").setLevel(logging.WARNING)


def keep_admin_key(settings: Settings, key_file: Path) -> None:
    """Make sure that a file holds an admin key of this service; a key that is valid is kept.

    Raises
    ------
    FarmFailed
        If the database does not answer, or is a file that is damaged or none.
    """
    with opened(settings.database, must_exist=False) as database:
        migrate(database)
        with database.writing() as session:
            known = keys.caller_of_key(session, _key_in(key_file), now_s=time.time())
            if known is None or known.role is not Role.ADMIN:
                _, key = keys.create_key(session, "admin", Role.ADMIN, owner_id=ADMIN_OWNER)
                key_file.parent.mkdir(parents=True, exist_ok=True)
                write_private(key_file, key + "\n")  # If this fails, the new key is rolled back.
                log.info("%s has a new admin key; `lippmann keys link` makes a link that logs a browser in", key_file)


def _key_in(key_file: Path) -> str:
    try:
        return key_file.read_text("utf-8").strip()
    except FileNotFoundError:
        return ""
