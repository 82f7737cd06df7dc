"""create_app() and the server it runs in: the parts are put together here, and nothing is decided."""

from __future__ import annotations

import socket
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool

from service import dashboard
from service.broker_stream import Stream
from service.coordinator.coordinator import Clerk
from service.db.engine import Database
from service.db.migrations import migrate
from service.dependencies import House
from service.events.wakeup import Bell
from service.health import Checks, package_version
from service.ports import Parts
from service.routes import artifacts, design, events, health, jobs, keys, login, looks, problems, scenes, tasks, workers
from service.routes.middleware import BodyLimit, RequestId
from service.scenes import sync_builtin
from service.settings import Settings
from service.viewing.frames import Sheets

API = "/api/v1"
SHUTDOWN_S = 5
"""The longest that requests may take to end when the server is told to stop."""


def create_app(settings: Settings, parts: Parts, *, clock: Callable[[], float] = time.time) -> FastAPI:
    """Return the service; it connects to nothing before it is started."""
    app = FastAPI(
        title="Lippmann",
        version=package_version(),
        lifespan=_lifespan,
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        separate_input_output_schemas=False,
    )
    app.state.house = _furnish(settings, parts, clock)
    for module in (health, scenes, design, jobs, tasks, looks, artifacts, events, workers, keys):
        app.include_router(module.router, prefix=API)
    app.include_router(login.api, prefix=API)
    app.include_router(login.router, include_in_schema=False)
    app.include_router(dashboard.router, include_in_schema=False)
    problems.install(app)
    app.add_middleware(BodyLimit, limit_bytes=int(settings.body_limit_mb * 1e6))
    app.add_middleware(RequestId)
    return app


class Server(uvicorn.Server):
    """A server of one application, which ends open streams at once when it is told to stop."""

    def __init__(self, app: FastAPI, *, host: str, port: int) -> None:
        quiet: dict[str, Any] = {"log_config": None, "access_log": False, "server_header": False}
        super().__init__(uvicorn.Config(app, host=host, port=port, timeout_graceful_shutdown=SHUTDOWN_S, **quiet))
        self._house: House = app.state.house

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, then everything."""
        self._house.bell.close()
        await super().shutdown(sockets)


def _furnish(settings: Settings, parts: Parts, clock: Callable[[], float]) -> House:
    database = Database(settings.database)
    stream = Stream(settings.redis_url, timeout_s=settings.broker_timeout_s)
    checks = Checks(database, parts.store, stream)
    sheets = Sheets(parts, room_bytes=int(settings.sheets_mb * 1e6))
    return House(settings, parts, database, Bell(), stream, checks, sheets, clock)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    house: House = app.state.house
    await run_in_threadpool(migrate, house.database)
    await run_in_threadpool(sync_builtin, house.database, house.parts, now_s=house.now_s())
    clerk = None
    if house.settings.clerk:
        clerk = Clerk(house.database, house.parts.store, house.settings, house.bell, clock=house.clock)
        clerk.start()
    try:
        yield
    finally:
        house.bell.close()
        if clerk is not None:
            await run_in_threadpool(clerk.stop)
        house.stream.close()
        house.database.dispose()
