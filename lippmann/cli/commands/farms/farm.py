"""Farms: a complete one on this machine, or its parts."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.engines import check_mitsuba, check_povray, has_mitsuba, has_povray, may_render
from lippmann.cli.exit_codes import ExitCode
from lippmann.cli.options import DATA_DIR, DataDir, OutputFolder
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.farm.supervisor.farm import Farm
    from lippmann.farm.supervisor.plan import FarmPlan
    from lippmann.join_file import JoinFile

Host = Annotated[str, typer.Option(envvar="LIPPMANN_HOST", help="The address to listen on.")]
Port = Annotated[
    int,
    typer.Option(envvar="LIPPMANN_PORT", min=0, max=65_535, help="The port to listen on. 0 takes a free port."),
]
Slots = Annotated[
    int | None,
    typer.Option(
        envvar="LIPPMANN_SLOTS", min=1, max=1024, help="The tasks that run at once. The default is one for each core."
    ),
]
PublicUrl = Annotated[
    str,
    typer.Option(
        envvar="LIPPMANN_PUBLIC_URL", help="The URL at which users reach the service, if it is not the address itself."
    ),
]


def up(
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 8080,
    slots: Slots = None,
    public_url: PublicUrl = "",
    open_browser: Annotated[bool, typer.Option("--open", help="Open the dashboard in a browser, logged in.")] = False,
    *,
    output: Output,
) -> None:
    """Start a farm on this machine: broker, service and worker. Ctrl-C stops it, and the next start continues."""
    from lippmann.farm.browser_starter import browser_starter
    from lippmann.farm.supervisor.plan import FarmPlan

    renders = may_render(output)
    plan = FarmPlan(
        data_dir, host=host, port=port, slots=slots or _cores(), public_url=public_url, without_povray=not renders
    )
    # The browser must outlive the farm, so what starts it leaves before the farm adopts orphans.
    with browser_starter() if open_browser else nullcontext() as open_at, _farm(plan, output) as farm:
        _stay_up(farm, data_dir, output, open_at=open_at)


def demo(
    frames: Annotated[str, typer.Option(help="The frames to render. 1-45 is a full turn of the fish.")] = "1-6",
    engine: Annotated[
        Literal["povray", "mitsuba"], typer.Option(help="The engine. With mitsuba the fish is made of triangles.")
    ] = "povray",
    out: OutputFolder = Path("out"),
    stay: Annotated[bool, typer.Option("--stay", help="Keep the farm running afterwards.")] = False,
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 0,
    slots: Slots = None,
    *,
    output: Output,
) -> None:
    """Render the integral video of the paper on this machine. A farm starts, runs the job and ends."""
    from lippmann.client import Client
    from lippmann.client.fetch_record import check_folder
    from lippmann.farm.demo import demo_data, demo_text, run_demo
    from lippmann.farm.supervisor.plan import FarmPlan
    from lippmann.job.animation.frames import parse_frames
    from lippmann.local.files.writable import check_writable

    parse_frames(frames)
    check_writable(out)
    check_folder(out, job_id=None, is_demo=True)
    if engine == "mitsuba":
        check_mitsuba()
    else:
        check_povray()
    plan = FarmPlan(
        data_dir,
        host=host,
        port=port,
        slots=slots or _cores(),
        without_povray=engine == "mitsuba" and not has_povray(),
    )
    with _farm(plan, output) as farm:
        with Client(farm.address.url, farm.address.key, patience_s=60.0) as client:
            made = run_demo(client, frames=frames, engine=engine, out=out, output=output)
        output.result(demo_data(made), demo_text(made))
        if stay:
            _stay_up(farm, data_dir, Output(as_json=False))


def serve(
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 8080,
    key_file: Annotated[
        Path | None,
        typer.Option(envvar="LIPPMANN_KEY_FILE", help="The file for an admin key. It is written if it does not exist."),
    ] = None,
    listen_fd: Annotated[
        int | None, typer.Option(hidden=True, help="The descriptor of a socket that already listens.")
    ] = None,
    *,
    output: Output,
) -> None:
    """Start only the service. LIPPMANN_REDIS_URL and LIPPMANN_DATABASE_URL name the broker and the database."""
    import socket

    from lippmann.farm.listening import listening_socket, url_of

    # The port is taken first, so that a port in use is reported at once.
    listening = listening_socket(host, port) if listen_fd is None else socket.socket(fileno=listen_fd)
    url, bound_port = url_of(listening), listening.getsockname()[1]

    from lippmann.errors import FarmFailed
    from lippmann.farm.serve import run_service
    from service.settings import Settings

    _prepare_folder(data_dir, data_dir)
    settings = Settings(
        data_dir=data_dir, host=host, port=bound_port, public_url=os.environ.get("LIPPMANN_PUBLIC_URL") or url
    )
    if output.as_json:
        output.result({"url": url, "pid": os.getpid()}, "")
    if not run_service(settings, listening, key_file=key_file):
        raise FarmFailed("the service did not start")


def worker(
    data_dir: DataDir = DATA_DIR,
    slots: Slots = None,
    join: Annotated[
        Path | None,
        typer.Option(
            envvar="LIPPMANN_JOIN_FILE",
            help="The file with which this machine joins a farm, from `keys create --worker`. It needs nothing else.",
        ),
    ] = None,
    pool: Annotated[
        str | None,
        typer.Option(help="The pool of the worker, whose jobs alone it does. The default is LIPPMANN_WORKER_POOL."),
    ] = None,
    tag: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TAG", help="A tag of the worker; it may be repeated. The default is LIPPMANN_WORKER_TAGS."
        ),
    ] = None,
    *,
    output: Output,
) -> None:
    """Start only a worker. LIPPMANN_REDIS_URL or a join file names the broker.

    Without a bucket, the data folder is that of the service.
    """
    from lippmann.farm.worker import run_worker, worker_name
    from worker.settings import WorkerSettings

    found = None if join is None else _read_join_file(join)
    _set_profile(pool, tag)
    _prepare_folder(data_dir, data_dir / "scratch")  # It writes the artifacts too, which may be another volume.
    if found is not None:
        _join_farm(found, data_dir, output)
    if WorkerSettings().needs_povray and not has_mitsuba():
        check_povray()
    os.environ["LIPPMANN_DATA_DIR"] = str(data_dir)
    slots = slots or _cores()
    if output.as_json:
        output.result({"worker": worker_name(), "slots": slots, "pid": os.getpid()}, "")
    run_worker(slots=slots)


def _read_join_file(path: Path) -> JoinFile:
    from datetime import UTC, datetime

    from lippmann.join_file import read_join_file

    return read_join_file(path, now=datetime.now(UTC))


def _join_farm(join: JoinFile, data_dir: Path, output: Output) -> None:
    """Take the settings of this process from a join file."""
    from lippmann.farm.joining import join_farm

    for name in join_farm(join, data_dir, os.environ):
        output.note(f"note: {name} of the environment does not count, since there is a join file")
    output.note(f"Joining {join.farm} with the worker key {join.worker.id} ({join.worker.name}).")


def status(output: Output, connection: Connection) -> None:
    """Show health, workers, space and open jobs of the farm.

    The exit code is 0 when everything works, and 1 when something does not.
    """
    from lippmann.cli.text.farm import COUNTED, FarmState, status_data, status_text
    from lippmann.job.states import ENDED_JOBS, JobStatus

    with connection.client() as client:
        health = client.health()
        workers = client.workers()
        open_jobs = [status for status in JobStatus if status not in ENDED_JOBS]
        jobs = {status.value: tuple(client.jobs(status=status, limit=COUNTED + 1)) for status in open_jobs}
        farm = FarmState(client.address.url, health, workers.items if workers.known else None, jobs)
    output.result(status_data(farm), status_text(farm))
    if health.status != "ok":
        raise typer.Exit(ExitCode.FAILED)


def _set_profile(pool: str | None, tags: list[str] | None) -> None:
    """Give the settings of the worker the pool and the tags of the command line, and check them."""
    from worker.settings import WorkerSettings

    given = {"LIPPMANN_WORKER_POOL": pool, "LIPPMANN_WORKER_TAGS": ",".join(tags) if tags else None}
    os.environ |= {name: value for name, value in given.items() if value is not None}
    WorkerSettings()


def _prepare_folder(data_dir: Path, written: Path) -> None:
    """Close the data folder to other users of the machine, and check that a folder of it can be written."""
    from lippmann.local.files.writable import check_writable
    from lippmann.private_files import close_parts, keep_private, make_passable

    keep_private()
    with suppress(OSError):  # the check says what is wrong
        make_passable(written)
    close_parts(data_dir)
    check_writable(written)


@contextmanager
def _farm(plan: FarmPlan, output: Output) -> Iterator[Farm]:
    from lippmann.farm.supervisor.farm import running_farm

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # A signal that is ignored from the start stays ignored: SIGHUP under nohup, SIGINT in a script's background.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)  # The signal ends the farm as Ctrl-C does.
    output.note("Starting ...")

    def note(event: Mapping[str, Any]) -> None:
        # The worker is ready after the farm is up, and the last line is then the link to it.
        if event["event"] != "child_ready" or event["child"] != "worker":
            output.note(_EVENTS[event["event"]](event))

    with running_farm(plan, on_event=note) as farm:
        yield farm


def _stay_up(farm: Farm, data_dir: Path, output: Output, *, open_at: Callable[[str], bool] | None = None) -> None:
    """Print the address of the farm, and wait until the user stops it.

    Parameters
    ----------
    open_at
        Opens a browser at a URL, and returns whether there is one; None if none is wanted.
    """
    try:
        _print_address(farm, data_dir, output)
        if open_at is not None:
            _open_browser(farm, open_at, output)
        farm.wait()
    except KeyboardInterrupt:
        return  # The user stops the farm, which is a success.


def _print_address(farm: Farm, data_dir: Path, output: Output) -> None:
    from lippmann.client import Client
    from lippmann.terminal.progress import time_text

    with Client(farm.address.url, farm.address.key) as client:
        link = client.login_link()
    data = {"url": farm.address.url, "login_url": link.url, "data_dir": str(data_dir.resolve()), "pid": os.getpid()}
    until = time_text(link.expires_at)
    text = "\n".join(
        [
            "Lippmann is up.",
            f"  data   {data_dir.resolve()}   (The logs are in log/, and the admin key is in admin.key.)",
            "  Ctrl-C stops the farm. The next start continues where it stopped.",
            "",
            f"Open this link in a browser. It works once, until {until}; `lippmann keys link` makes another one.",
            "",
            f"    {link.url}",
        ]
    )
    output.result(data, text)


def _open_browser(farm: Farm, open_at: Callable[[str], bool], output: Output) -> None:
    """Open the dashboard by a link of its own, so that the printed link still works."""
    from lippmann.client import Client
    from lippmann.farm.browser_door import open_browser

    def make_link() -> str:
        with Client(farm.address.url, farm.address.key) as client:
            return client.login_link().url

    if not open_browser(make_link, open_at):
        output.note("note: expected a browser for --open, got none; open the link above")


_EVENTS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "child_ready": lambda event: f"  {event['child']} is ready",
    "died": lambda event: f"  {event['child']} ended ({event['code']}) and restarts in {event['pause_s']:g} s",
    "restarted": lambda event: f"  {event['child']} has restarted",
    "stopping": lambda event: f"  {event['child']} is stopping",
    "killing": lambda _: "  killing all processes now",
}
"""The note for each event of the supervisor."""


def _cores() -> int:
    return len(os.sched_getaffinity(0))
