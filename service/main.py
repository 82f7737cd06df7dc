"""The application and its server. This module only wires the other modules."""

from __future__ import annotations

import asyncio
import os
import platform
import socket
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any

import structlog
import uvicorn
from fastapi import FastAPI
from sqlalchemy.exc import SQLAlchemyError
from starlette.concurrency import run_in_threadpool

from lippmann.descriptors import raise_descriptor_limit
from lippmann.errors import BadInput, StoreFull, StoreUnavailable
from lippmann.logs import trace_of
from lippmann.telemetry import start_telemetry, stop_telemetry
from service import dashboard
from service.artifact_links import ArtifactLinks
from service.broker_stream import Stream
from service.connections import ConnectionGuard, ConnectionLimits, most_connections
from service.coordinator.coordinator import Coordinator
from service.db.engine import Database
from service.db.migrations import migrate
from service.dependencies import AppState
from service.events.hub import EventHub
from service.events.wakeup import Wakeup
from service.health import Checks, package_version
from service.instruments import LOOP_LAG_S, Refusal
from service.jobs.artifact_guard import ArtifactGuard
from service.last_use import WRITE_S, LastUse
from service.metrics.access import MonitorAccess
from service.metrics.readings import FarmReader
from service.ports import Parts
from service.previews.run import Previews
from service.rate_limits import RateLimit, RateLimits
from service.roster import RosterCache
from service.routes import (
    artifacts,
    design,
    events,
    farm,
    health,
    jobs,
    keys,
    links,
    login,
    metrics,
    outputs,
    preview,
    problems,
    scenes,
    schemas,
    tasks,
    viewing,
    webhooks,
    worker_keys,
    workers,
)
from service.routes.description import DescribedApp
from service.routes.json_bodies import JsonBodies
from service.routes.middleware import AddressRate, BodyLimit, HeadAsGet, PathPrefix, RequestTimes, ResponseHeaders
from service.scenes import sync_builtin
from service.schemas.links import API
from service.settings import Settings
from service.store_identity import identify_store
from service.viewing.process_handle import ProcessLimits
from service.viewing.process_pool import ProcessPool
from service.viewing.queue import AT_ONCE, PictureQueue
from service.worker_keys.broker_users import BrokerUsers
from service.worker_keys.registry import WorkerKeys

SHUTDOWN_S = 5
"""The longest time for open requests when the server stops."""
LAG_EVERY_S = 0.5
"""The interval at which it is measured how late the event loop is."""
END_IDLE_S = 5.0
"""The interval at which the processes that make pictures are looked after."""

log = structlog.get_logger("service.main")


def create_app(settings: Settings, parts: Parts, *, clock: Callable[[], float] = time.time) -> FastAPI:
    """Create the application; it connects to nothing before it is started."""
    app = DescribedApp(
        title="Lippmann",
        version=package_version(),
        lifespan=_lifespan,
        openapi_url=None,  # The route of `routes.health` returns it to callers with a key.
        docs_url=None,
        redoc_url=None,
        servers=[{"url": settings.path_prefix}] if settings.path_prefix else None,
        separate_input_output_schemas=False,
    )
    app.state.lippmann = _build_state(settings, parts, clock)
    for module in (
        health,
        schemas,
        scenes,
        design,
        preview,
        jobs,
        tasks,
        viewing,
        artifacts,
        outputs,
        links,
        events,
        workers,
        farm,
        keys,
        worker_keys,
        webhooks,
    ):
        app.include_router(module.router, prefix=API)
    for router in (login.api, metrics.api):
        app.include_router(router, prefix=API)
    app.webhooks.include_router(webhooks.messages)
    for router in (login.router, metrics.router):
        app.include_router(router, include_in_schema=False)
    if settings.oidc_issuer:
        _add_openid(app, settings, clock)
    for router in (dashboard.router, dashboard.help_router):
        app.include_router(router, include_in_schema=False)
    problems.install(app, page=partial(dashboard.problem_page, settings.path_prefix))
    app.add_middleware(RequestTimes)
    app.add_middleware(HeadAsGet)
    app.add_middleware(JsonBodies)
    app.add_middleware(BodyLimit, limit_bytes=int(settings.body_limit_mb * 1e6))
    app.add_middleware(AddressRate, rate=app.state.lippmann.rates.by_address)
    app.add_middleware(ResponseHeaders, is_https=settings.base_url.startswith("https://"))
    if settings.path_prefix:
        app.add_middleware(PathPrefix, prefix=settings.path_prefix)
    return app


def _add_openid(app: FastAPI, settings: Settings, clock: Callable[[], float]) -> None:
    """Add the login with an OpenID provider. Its libraries are an extra, and nobody else waits for their import."""
    try:
        from service.oidc.provider import Provider
        from service.routes import openid
    except ModuleNotFoundError as error:
        raise BadInput(f"LIPPMANN_OIDC_ISSUER needs the extra `oidc`: pip install lippmann[oidc] ({error})") from error
    app.state.openid = Provider(settings, now_s=clock)
    app.include_router(openid.router, include_in_schema=False)


class Server(uvicorn.Server):
    """A server of one application, which ends open event streams at once when it stops."""

    def __init__(self, app: FastAPI, *, host: str, port: int) -> None:
        self._state: AppState = app.state.lippmann
        self.guard = ConnectionGuard(_connection_limits(self._state.settings))
        quiet: dict[str, Any] = {"log_config": None, "access_log": False, "server_header": False}
        protocol: Any = self.guard.protocol
        proxies = [str(network) for network in self._state.settings.proxy_networks]
        super().__init__(
            uvicorn.Config(
                app, host=host, port=port, http=protocol, ws="none", timeout_graceful_shutdown=SHUTDOWN_S,
                proxy_headers=bool(proxies), forwarded_allow_ips=proxies, **quiet,
            )
        )  # fmt: skip

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the event streams, then the server."""
        self._state.hub.end_streams()
        await super().shutdown(sockets)


def _connection_limits(settings: Settings) -> ConnectionLimits:
    total = most_connections(raise_descriptor_limit(), settings.connections)
    return ConnectionLimits(
        total=total,
        by_address=min(settings.connections_per_address, total * 3 // 4),
        headers_s=settings.request_headers_s,
        body_s=settings.request_body_s,
        exempt=settings.proxy_networks,
    )


def _process_limits(settings: Settings) -> ProcessLimits:
    return ProcessLimits(
        places=AT_ONCE,
        room_bytes=int(settings.sheets_mb * 1e6),
        memory_bytes=settings.picture_memory_mb * 1_000_000,
        timeout_s=settings.picture_timeout_s,
        idle_s=settings.picture_idle_s,
    )


def _build_state(settings: Settings, parts: Parts, clock: Callable[[], float]) -> AppState:
    database = Database(settings.database, reserve_bytes=round(settings.database_reserve_mb * 1e6))
    last_use = LastUse(database)
    registry = WorkerKeys(
        database, needed=settings.workers_need_keys, clock=clock,
        note_use=lambda key_id, now_s: last_use.note(key_id, now_s=now_s),
    )  # fmt: skip
    seals = registry.seals(settings)
    stream = Stream(settings.broker, seals=seals, timeout_s=settings.broker_timeout_s)
    broker_users = BrokerUsers(settings.broker, timeout_s=settings.broker_timeout_s)
    checks = Checks(database, parts.store, stream)
    processes = ProcessPool(parts, _process_limits(settings))
    guard = ArtifactGuard(database, parts.store)
    wakeup = Wakeup()
    hub = EventHub(
        database, wakeup, keepalive_s=settings.keepalive_s, now_s=clock, has_owners=not settings.sharing,
        idle_s=settings.session_idle_s,
    )  # fmt: skip
    roster = RosterCache(stream)
    rates = RateLimits(
        by_key=RateLimit(settings.requests_per_minute),
        by_address=RateLimit(settings.requests_per_minute_by_address, counted_as=Refusal.ADDRESS),
        failed_logins=RateLimit(settings.failed_logins_per_minute, counted_as=Refusal.LOGIN),
    )
    pictures = PictureQueue()
    artifact_links = ArtifactLinks(settings.link_keys.keys)
    return AppState(
        settings,
        parts,
        database,
        wakeup,
        hub,
        stream,
        checks,
        processes,
        guard,
        roster,
        last_use,
        rates,
        pictures,
        Previews(settings, seals=seals),
        artifact_links,
        MonitorAccess(settings),
        FarmReader(database, parts.store, stream),
        broker_users,
        registry,
        clock,
    )


async def _repeat(run: Callable[[], object], *, every_s: float) -> None:
    """Call a function again and again, in a thread; a call that fails is logged."""
    while True:
        await asyncio.sleep(every_s)
        try:
            await run_in_threadpool(run)
        except Exception as error:  # the outermost frame of the task
            log.warning("work that repeats failed", work=run.__qualname__, error=repr(error), trace=trace_of(error))


async def _measure_loop() -> None:
    loop = asyncio.get_running_loop()
    while True:
        due_s = loop.time() + LAG_EVERY_S
        await asyncio.sleep(LAG_EVERY_S)
        LOOP_LAG_S.observe(max(0.0, loop.time() - due_s))


def _prepare_store(state: AppState) -> bool:
    """Identify the store and store the built-in scenes; return False if the store is away or full."""
    try:
        identify_store(state.database, state.parts.store)
        sync_builtin(state.database, state.parts, now_s=state.now_s())
    except (StoreFull, StoreUnavailable) as error:
        log.warning("the store is not ready; it is tried again", error=error.message)
        return False
    return True


async def _prepare_store_later(state: AppState) -> None:
    """Try again until the store is back; meanwhile health and the fault monitor give the reason."""
    while True:
        await asyncio.sleep(state.settings.store_check_s)
        try:
            with suppress(SQLAlchemyError):  # a database that is away, which health tells
                if await run_in_threadpool(_prepare_store, state):
                    return
        except Exception as error:  # the outermost frame of the task
            log.warning("the store could not be prepared", error=repr(error), trace=trace_of(error))


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    state: AppState = app.state.lippmann
    instance = f"{platform.node()}-{os.getpid()}"
    start_telemetry(state.settings.telemetry_url, process="lippmann-service", instance=instance)
    await run_in_threadpool(migrate, state.database)
    await run_in_threadpool(state.settings.order_keys.ensure)
    await run_in_threadpool(state.settings.link_keys.ensure)
    await run_in_threadpool(state.database.reserve.keep)
    preparing = None
    if not await run_in_threadpool(_prepare_store, state):
        preparing = asyncio.create_task(_prepare_store_later(state))
    state.hub.start()
    repeated = [
        asyncio.create_task(_repeat(state.last_use.write, every_s=WRITE_S)),
        asyncio.create_task(_repeat(state.processes.end_idle, every_s=END_IDLE_S)),
        asyncio.create_task(_measure_loop()),
    ]
    coordinator = None
    if state.settings.coordinator:
        coordinator = Coordinator(
            state.database, state.parts.store, state.settings, state.wakeup, clock=state.clock,
            worker_keys=state.worker_keys,
        )  # fmt: skip
        state.checks.monitor = coordinator.fault_monitor
        coordinator.start()
    try:
        yield
    finally:
        for task in repeated:
            task.cancel()
        if preparing is not None:
            preparing.cancel()
        await state.hub.close()
        await run_in_threadpool(state.last_use.write)
        if coordinator is not None:
            await run_in_threadpool(coordinator.stop)
        await run_in_threadpool(state.processes.close)
        state.guard.close()
        state.stream.close()
        state.previews.close()
        state.broker_users.close()
        state.database.dispose()
        await run_in_threadpool(stop_telemetry)
