"""Farms: all of one on this machine, or its parts."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from lippmann.farm.supervisor.farm import Farm

Host = Annotated[str, typer.Option(envvar="LIPPMANN_HOST", help="The address to listen on.")]
Port = Annotated[
    int, typer.Option(envvar="LIPPMANN_PORT", min=0, max=65_535, help="The port to listen on; 0 takes a free one.")
]
Slots = Annotated[
    int | None,
    typer.Option(envvar="LIPPMANN_SLOTS", min=1, max=1024, help="Tasks at once; else as many as there are cores."),
]
PublicUrl = Annotated[str, typer.Option(envvar="LIPPMANN_PUBLIC_URL", help="What users type to get here, if not this.")]


def up(
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 8080,
    slots: Slots = None,
    public_url: PublicUrl = "",
    as_json: AsJson = False,
) -> None:
    """Start a farm on this machine: broker, service and workers. Ctrl-C ends all of them; the next start goes on."""
    talk = Talk(as_json)
    with _farm(data_dir, host, port, slots, public_url, talk) as farm:
        _stay_up(farm, data_dir, talk)


def demo(
    frames: Annotated[str, typer.Option(help="Which frames; 1-45 is the full turn.")] = "1-6",
    out: Annotated[Path, typer.Option(help="The folder to bring files to.")] = Path("out"),
    stay: Annotated[bool, typer.Option("--stay", help="Keep the farm up afterwards.")] = False,
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 0,
    slots: Slots = None,
    as_json: AsJson = False,
) -> None:
    """Render the paper's integral video here: a farm, a job, its files in out/, and where to look."""
    from lippmann.client import Client
    from lippmann.farm.demo import demo_data, demo_text, run_demo
    from lippmann.job.frames import parse_frames
    from lippmann.local.files.writable import check_writable

    parse_frames(frames)
    check_writable(out)
    talk = Talk(as_json)
    with _farm(data_dir, host, port, slots, "", talk) as farm:
        with Client(farm.address.url, farm.address.key, patience_s=60.0) as client:
            made = run_demo(client, frames=frames, out=out, talk=talk)
        talk.result(demo_data(made), demo_text(made))
        if stay:
            _stay_up(farm, data_dir, Talk(as_json=False))


def serve(
    data_dir: DataDir = DATA_DIR,
    host: Host = "127.0.0.1",
    port: Port = 8080,
    key_file: Annotated[
        Path | None,
        typer.Option(envvar="LIPPMANN_KEY_FILE", help="Keeps an admin key; written when it is not there."),
    ] = None,
    listen_fd: Annotated[int | None, typer.Option(hidden=True, help="A socket that listens already.")] = None,
    as_json: AsJson = False,
) -> None:
    """Start the service alone. LIPPMANN_REDIS_URL and LIPPMANN_DATABASE_URL say where broker and database are."""
    import socket

    from lippmann.farm.listening import listening_socket, url_of

    # Before anything else: a port that is taken is said at once.
    listening = listening_socket(host, port) if listen_fd is None else socket.socket(fileno=listen_fd)
    url, bound_port = url_of(listening), listening.getsockname()[1]

    from lippmann.errors import FarmFailed
    from lippmann.farm.serve import run_service
    from lippmann.local.files.writable import check_writable
    from service.settings import Settings

    check_writable(data_dir)
    settings = Settings(
        data_dir=data_dir, host=host, port=bound_port, public_url=os.environ.get("LIPPMANN_PUBLIC_URL") or url
    )
    if as_json:
        Talk(as_json).result({"url": url, "pid": os.getpid()}, "")
    if not run_service(settings, listening, key_file=key_file):
        raise FarmFailed("the service did not come up")


def worker(data_dir: DataDir = DATA_DIR, slots: Slots = None, as_json: AsJson = False) -> None:
    """Start a worker alone. LIPPMANN_REDIS_URL says where the broker is; the data folder is shared with the service."""
    from lippmann.farm.worker import run_worker, worker_name
    from lippmann.local.files.writable import check_writable
    from worker.engines.povray.version import check_povray

    check_writable(data_dir)
    check_povray(os.environ.get("LIPPMANN_POVRAY", "povray"))
    os.environ["LIPPMANN_DATA_DIR"] = str(data_dir)
    slots = slots or _cores()
    if as_json:
        Talk(as_json).result({"worker": worker_name(), "slots": slots, "pid": os.getpid()}, "")
    run_worker(slots=slots)


@contextmanager
def _farm(data_dir: Path, host: str, port: int, slots: int | None, public_url: str, talk: Talk) -> Iterator[Farm]:
    from lippmann.farm.supervisor.farm import running_farm
    from lippmann.farm.supervisor.plan import FarmPlan
    from worker.engines.povray.version import check_povray

    check_povray(os.environ.get("LIPPMANN_POVRAY", "povray"))
    plan = FarmPlan(data_dir, host=host, port=port, slots=slots or _cores(), public_url=public_url)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # What is ignored from the start stays ignored: SIGHUP under nohup, SIGINT in the background of a script.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)  # ends like Ctrl-C
    talk.note("Starting ...")
    with running_farm(plan, on_event=lambda event: _say_event(event, talk)) as farm:
        yield farm


def _stay_up(farm: Farm, data_dir: Path, talk: Talk) -> None:
    """Say where the farm is, and wait until it is told to end."""
    try:
        _say_up(farm, data_dir, talk)
        farm.wait()
    except KeyboardInterrupt:
        return  # to be told so is how it ends well


def _say_up(farm: Farm, data_dir: Path, talk: Talk) -> None:
    from lippmann.client import Client

    with Client(farm.address.url, farm.address.key) as client:
        link = client.login_link()
    data = {"url": farm.address.url, "login_url": link.url, "data_dir": str(data_dir.resolve()), "pid": os.getpid()}
    until = link.expires_at.astimezone().strftime("%H:%M")
    text = "\n".join(
        [
            "Lippmann is up.",
            f"  open   {link.url}",
            f"         (works once, until {until}; another one: lippmann keys link)",
            f"  data   {data_dir.resolve()}   (logs in log/, the admin key in admin.key)",
            "  Ctrl-C ends it; the next start goes on where it stopped.",
        ]
    )
    talk.result(data, text)


_EVENTS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "working": lambda event: f"  {event['child']} works",
    "died": lambda event: f"  {event['child']} ended ({event['code']}); it starts again in {event['pause_s']:g} s",
    "restarted": lambda event: f"  {event['child']} started again",
    "stopping": lambda event: f"  {event['child']} is asked to end",
    "hurrying": lambda _: "  ending everything at once",
}


def _say_event(event: Mapping[str, Any], talk: Talk) -> None:
    talk.note(_EVENTS[event["event"]](event))


def _cores() -> int:
    return len(os.sched_getaffinity(0))
