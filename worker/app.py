"""The Celery application of a worker: Celery delivers orders, without results, retries or canvas."""

from __future__ import annotations

import ctypes
import os
import platform
import signal
import sys
import threading
import time
from contextlib import suppress
from importlib.metadata import version
from typing import Any

import structlog
from billiard.process import active_children
from celery import Celery
from celery.signals import (
    celeryd_after_setup,
    setup_logging,
    worker_init,
    worker_process_init,
    worker_process_shutdown,
    worker_ready,
    worker_shutdown,
    worker_shutting_down,
)
from kombu.entity import Queue
from redis.exceptions import RedisError

from lippmann.errors import LippmannError, PovrayMissing, SandboxMissing
from lippmann.job.messages import wire
from lippmann.job.messages.events import NO_POVRAY, Presence, PresenceFault
from lippmann.job.messages.protocol import OLDEST_PROTOCOL, PROTOCOL
from lippmann.logs import configure_logs
from lippmann.telemetry import start_telemetry, stop_telemetry
from worker.consumer import OrderConsumer
from worker.drain_signals import drain_by_signals
from worker.duty import Duty, first_queue
from worker.engines.mitsuba.version import Found, Missing, mitsuba_version
from worker.engines.povray.version import povray_version
from worker.handover import Handover
from worker.liveness import ConsumerLiveness, StuckWatch
from worker.preview_orders import PreviewOrders
from worker.preview_process import PreviewProcess
from worker.refusals import refusals
from worker.report import QUICK_S, BrokerClient
from worker.sandbox.detect import detect_once
from worker.sandbox.groups import make_room
from worker.settings import STOPPING, WorkerSettings
from worker.store.owner import check_owner
from worker.whole_file import check_folder

log = structlog.get_logger()

REDELIVERY_S = 8 * 86_400
"""Longer than any time limit of a job: the service, not the broker, decides that an order is lost."""

LOST_WAIT_S = 0.5
"""The time that the result of a dead pool process may take to arrive; Celery waits 10 s. The
wait protects nothing here, since attempts report on the stream and not by results."""

STALE_STOPPING_S = 3600.0

EXIT_REFUSED = 78
"""The exit code of a worker whose key the farm refuses: EX_CONFIG of sysexits.h."""

_PR_SET_PDEATHSIG = 1


def _consumer(*args: Any, **options: Any) -> OrderConsumer:
    assert _liveness is not None  # noqa: S101 - Celery sends worker_init before it makes the consumer
    assert _duty is not None  # noqa: S101
    assert _broker is not None  # noqa: S101
    assert _previews is not None  # noqa: S101
    return OrderConsumer(
        _liveness, handover, settings.slots, _duty, _broker.directions, _previews.look_after, *args, **options
    )


def make_app(settings: WorkerSettings) -> Celery:
    """Return the Celery application of one worker."""
    queue = first_queue(settings.worker_pool, has_povray=True)
    app = Celery("lippmann", broker=wire.broker_url(settings.broker), include=["worker.tasks.entry"])
    transport = {
        "global_keyprefix": wire.CARRIER_PREFIX,
        "visibility_timeout": REDELIVERY_S,
        "socket_timeout": 5,
        "socket_connect_timeout": 5,
        "socket_keepalive": True,
    }
    app.conf.update(
        broker_transport_options=transport,
        result_backend_transport_options={"visibility_timeout": REDELIVERY_S},
        visibility_timeout=REDELIVERY_S,
        broker_connection_max_retries=None,
        broker_connection_retry_on_startup=True,
        # A broker that answers with an error (READONLY, NOREPLICAS, LOADING) may soon do so no longer.
        broker_channel_error_retry=True,
        task_queues=[Queue(queue, no_ack=True)],  # type: ignore[no-untyped-call]  # kombu has few types
        task_default_queue=queue,
        task_ignore_result=True,
        task_serializer="json",
        accept_content=["json"],
        worker_prefetch_multiplier=1,
        worker_disable_prefetch=True,
        worker_enable_prefetch_count_reduction=False,
        worker_cancel_long_running_tasks_on_connection_loss=False,
        worker_consumer=_consumer,
        worker_concurrency=settings.processes,
        worker_hijack_root_logger=False,
        worker_send_task_events=False,
        worker_enable_remote_control=False,
        worker_lost_wait=LOST_WAIT_S,
    )
    return app


settings = WorkerSettings()
"""The settings of this worker; its pool processes inherit them, and with them the name of the worker."""

app = make_app(settings)

handover = Handover()
"""The handover of the slots of this worker; its pool processes inherit it."""

is_key_refused = threading.Event()
"""Set when the farm refuses the key of this worker, which then ends."""

_liveness: ConsumerLiveness | None = None
_broker: BrokerClient | None = None
_duty: Duty | None = None
_stuck_watch: StuckWatch | None = None
_previews: PreviewProcess | None = None


@setup_logging.connect
def _log(**_: Any) -> None:
    """Write the log in place of Celery, whose tracebacks are not bounded."""
    configure_logs(sys.stderr, log_format=settings.log_format, fields={"worker": settings.worker_name})


@worker_init.connect
def _prepare(**_: Any) -> None:
    """Remove the files of earlier workers, and check that this worker can work."""
    global _liveness, _stuck_watch, _broker, _duty, _previews
    try:
        _remove_stopping_files()
        if not settings.store_url:
            check_owner(settings.artifacts_dir)
        settings.order_keys.keys()
        _broker = BrokerClient(
            settings.broker, settings.worker_name, settings.instance, seals=settings.seals, timeout_s=QUICK_S
        )
        _check_key(_broker)
        _previews = PreviewProcess(settings, _preview_orders())
        profile = presence().model_copy(update={"previews": _previews.is_offered})
        if not profile.has_povray:
            queue = first_queue(profile.pool, has_povray=False)
            app.conf.update(task_queues=[Queue(queue, no_ack=True)], task_default_queue=queue)  # type: ignore[no-untyped-call]
        _duty = Duty(profile, settings.worker_hours)
        _liveness = ConsumerLiveness(
            _broker, profile, settings.heartbeat_file, find_fault=find_fault, refused=lambda: refusals.count,
            on_key_refused=_end_refused,
        )  # fmt: skip
        _stuck_watch = StuckWatch(_liveness, settings.stopping_file)
    # Celery logs and ignores errors of signal handlers; these mean that no order could be done here.
    except LippmannError as error:
        raise SystemExit(f"lippmann worker: {error.message}") from error
    except OSError as error:
        raise SystemExit(f"lippmann worker: expected files and programs that can be used, got {error}") from error


def _remove_stopping_files() -> None:
    """Remove the file of an earlier start of this worker, and of workers that were killed while they shut down."""
    settings.scratch_dir.mkdir(parents=True, exist_ok=True)
    for left in settings.scratch_dir.glob(f"{STOPPING}*"):
        with suppress(FileNotFoundError):  # another worker has just removed it
            if time.time() - left.stat().st_mtime > STALE_STOPPING_S:  # a name is not used twice
                left.unlink()
    settings.stopping_file.unlink(missing_ok=True)


def _preview_orders() -> PreviewOrders:
    return PreviewOrders(
        settings.broker, settings.worker_name, settings.instance, seals=settings.seals, timeout_s=QUICK_S
    )


def _check_key(broker: BrokerClient) -> None:
    """End if the farm already refuses the key of this worker. A broker that is away is no reason not to start."""
    key = settings.worker_key
    with suppress(RedisError):
        if broker.is_key_refused(None if key is None else key.id):
            is_key_refused.set()
            log.critical(_refused_text())
            raise SystemExit(EXIT_REFUSED)


def _end_refused() -> None:
    """End as on SIGTERM, once, because the farm refuses the key: nothing that this worker does would count."""
    if not is_key_refused.is_set():
        is_key_refused.set()
        log.critical(f"{_refused_text()}; the worker ends")
        os.kill(os.getpid(), signal.SIGTERM)


def _refused_text() -> str:
    if settings.worker_key is None:
        return "the farm accepts only workers with a key of their own; join it with a file (`lippmann worker --join`)"
    key_id = settings.worker_key.id
    return f"the farm refuses the key {key_id} of this worker: it was revoked, has expired, or is of another farm"


def broker_client() -> BrokerClient:
    """Return a client of the broker that speaks for this worker."""
    return BrokerClient(settings.broker, settings.worker_name, settings.instance, seals=settings.seals)


@celeryd_after_setup.connect
def _keep_hangup(instance: Any, **_: Any) -> None:
    """Keep Celery from the signal SIGHUP: without a terminal it would start the worker again, under nohup too."""
    instance._isatty = True


@worker_ready.connect
def _start_stuck_watch(**_: Any) -> None:
    if _stuck_watch:
        _stuck_watch.start()
    if _duty:
        drain_by_signals(_duty, drain_s=settings.drain_s, is_refused=is_key_refused.is_set)


def find_fault() -> PresenceFault | None:
    """Return why this worker can do no work now: its scratch folder is full or cannot be written."""
    try:
        check_folder(settings.scratch_dir, reserve_bytes=settings.disk_reserve_bytes)
    except LippmannError as error:
        return PresenceFault(code=error.code, message=error.message)
    return None


def presence() -> Presence:
    """Return the presence of this worker, with the sandbox and the POV-Ray that work here.

    Raises
    ------
    PovrayMissing, SandboxMissing
        If the worker could not do its work.
    """
    now_s = time.time()
    if settings.cgroup == "auto":
        make_room()
    sandbox = detect_once(settings.sandbox, cgroup=settings.cgroup)
    if sandbox.groups is not None:
        sandbox.groups.remove_stale()
    if sandbox.unused_group:
        log.warning("cgroup not used", reason=sandbox.unused_group)
    if sandbox.mode == "none" and settings.sandbox != "none":
        raise SandboxMissing("expected bubblewrap or Landlock to hold POV-Ray, got neither; install bubblewrap")
    versions = engine_versions()
    return Presence(
        name=settings.worker_name,
        instance=settings.instance,
        host=platform.node(),
        pid=os.getpid(),
        slots=settings.slots,
        sandbox=sandbox.text,
        povray=versions.get("povray", NO_POVRAY),
        version=version("lippmann"),
        started_s=now_s,
        seen_s=now_s,
        worker_key=None if settings.worker_key is None else settings.worker_key.id,
        pool=settings.worker_pool,
        tags=settings.worker_tags,
        memory_mb=settings.memory_mb,
        engines=tuple(versions),
        engine_versions=versions,
        hours=settings.worker_hours.text if settings.worker_hours else None,
        protocol=PROTOCOL,
        oldest_protocol=OLDEST_PROTOCOL,
        cores=os.cpu_count(),
    )


def engine_versions() -> dict[str, str]:
    """Return the versions of the engines that work here, by their names.

    Raises
    ------
    PovrayMissing
        If no engine works here, and the settings ask for POV-Ray.
    """
    found = mitsuba_version() if settings.mitsuba != "off" else None
    if isinstance(found, Missing):
        log.info("no Mitsuba", reason=found.reason)
    elif found is not None and found.note:
        log.warning("Mitsuba without the GPU", reason=found.note)
    mitsuba = {"mitsuba": f"{found.version} {found.variant}"} if isinstance(found, Found) else {}
    try:
        return {"povray": povray_version(settings.povray), **mitsuba}
    except PovrayMissing:
        if settings.needs_povray and not mitsuba:
            raise
        return mitsuba


@worker_shutting_down.connect
def _stop_attempts(**_: Any) -> None:
    """End running attempts within about a second; SIGTERM, the warm shutdown, waits for their final events."""
    try:
        settings.stopping_file.touch()
    except OSError:  # No attempt can learn of its end by the file, so its process ends.
        for process in active_children():
            process.terminate()
    if _stuck_watch:
        _stuck_watch.stop()


@worker_shutdown.connect
def _remove_presence(**_: Any) -> None:
    if _liveness:
        _liveness.remove()
    if _previews:
        _previews.end()
    settings.stopping_file.unlink(missing_ok=True)


@worker_process_init.connect
def _start_telemetry(**_: Any) -> None:
    """Send traces from each pool process: the thread that sends them would not survive the fork."""
    start_telemetry(settings.telemetry_url, process="lippmann-worker", instance=settings.worker_name)


@worker_process_shutdown.connect
def _stop_telemetry(**_: Any) -> None:
    stop_telemetry()


@worker_process_init.connect
def _leave_hangup(**_: Any) -> None:
    """Leave SIGHUP to the worker, which ends its attempts; a terminal that closes sends it to pool processes, too."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)


@worker_process_init.connect
def _end_with_parent(**_: Any) -> None:
    """Make a pool process end when the worker is killed, so that its POV-Ray ends too."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
