"""Examine this machine for a farm, a worker and the other commands, and name the way to get what it lacks."""

from __future__ import annotations

import importlib.util
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from lippmann.errors import FarmFailed, PovrayMissing, SandboxMissing, StoreUnavailable
from lippmann.farm.supervisor.broker import find_server
from lippmann.private_files import keep_private
from lippmann.terminal.progress import size_text
from service.doctor.finding import Check, Finding, Level
from worker.engines.mitsuba.version import Missing, mitsuba_version
from worker.engines.povray.version import check_povray, povray_version
from worker.sandbox.detect import detect
from worker.settings import WorkerSettings
from worker.store.opening import ARTIFACTS
from worker.store.owner import check_owner

LITTLE_BYTES = 2e9
"""The free space below which a disk is named as nearly full; a job of some frames needs some hundred megabytes."""
_EXTRAS = (
    ("matplotlib", "plots", "`lippmann paper` and `lippmann coding-study` draw no plots"),
    ("boto3", "s3", "a farm cannot keep its artifacts in S3"),
    ("psycopg", "postgresql", "a farm cannot use PostgreSQL"),
    ("authlib", "oidc", "nobody logs in to the dashboard with an account of an OpenID provider"),
)
"""Packages that are optional: the package, the extra that installs it, and what is not possible without it."""
_GPU_DEVICES = ("/dev/nvidiactl", "/dev/kfd", "/dev/dri/renderD128")


def examine_machine(data_dir: Path, *, has_farm: bool) -> Iterator[Finding]:
    """Yield what is found on this machine, and what is missing with the way to get it.

    Parameters
    ----------
    data_dir
        The data folder of a farm that runs here or that would be started here.
    has_farm
        Whether there is one. Then what only a worker or a new farm needs may be on other machines, so it is noted and
        no warning.
    """
    missing = Level.NOTE if has_farm else Level.WARNING
    yield _povray(missing)
    yield _mitsuba()
    yield _sandbox(missing)
    yield from _broker(missing)
    if has_farm:
        yield from () if WorkerSettings().store_url else _store_owner(data_dir)
    else:  # The space of a farm's store is a check of its own.
        yield _disk(data_dir)
    yield _cores_and_gpu()
    yield from _extras()


def _povray(missing: Level) -> Finding:
    command = os.environ.get("LIPPMANN_POVRAY", "povray")
    try:
        check_povray(command)
        text = f"POV-Ray {povray_version(command)} is {shutil.which(command)}"
    except PovrayMissing as error:
        return Finding(Check.POVRAY, missing, f"{error.message}; without it, nothing is rendered on this machine")
    return Finding(Check.POVRAY, Level.NOTE, text)


def _mitsuba() -> Finding:
    if WorkerSettings().mitsuba == "off":
        return Finding(
            Check.MITSUBA, Level.NOTE, "LIPPMANN_MITSUBA is off: a worker started here does not render with it"
        )
    found = mitsuba_version()
    if isinstance(found, Missing):
        message = f"{found.reason}; without it, scenes of Mitsuba are not rendered on this machine"
        return Finding(Check.MITSUBA, Level.NOTE, message)
    note = f"; not on the GPU: {found.note}" if found.note else ""
    return Finding(Check.MITSUBA, Level.NOTE, f"Mitsuba {found.version} works, by its variant {found.variant}{note}")


def _sandbox(missing: Level) -> Finding:
    """Return the sandbox in which a worker started here, by this shell and with its settings, would run scenes."""
    settings = WorkerSettings()
    wanted = settings.sandbox
    try:
        sandbox = detect(wanted, cgroup=settings.cgroup)
    except SandboxMissing as error:
        return Finding(Check.SANDBOX, Level.WARNING, error.message)
    unused = f"; a cgroup is not used: {sandbox.unused_group}" if sandbox.unused_group else ""
    if sandbox.mode != "none":
        memory = "each process of a task" if sandbox.groups is None else "each task as a whole, with a cgroup"
        message = f"a worker started here runs scenes in {sandbox.mode}; the kernel limits the memory of {memory}"
        return Finding(Check.SANDBOX, Level.WARNING if unused else Level.NOTE, message + unused)
    if wanted == "none":
        message = "LIPPMANN_SANDBOX is none: a worker with it renders only the built-in scenes"
        return Finding(Check.SANDBOX, Level.WARNING, message + unused)
    message = (
        "neither bubblewrap nor Landlock works here, so no worker can on this machine; install bubblewrap (Debian: "
        "apt-get install bubblewrap), or use Linux 5.13 or later with Landlock"
    )
    return Finding(Check.SANDBOX, Level.WARNING if unused else missing, message + unused)


def _broker(missing: Level) -> Iterator[Finding]:
    if os.environ.get("LIPPMANN_REDIS_URL"):
        return  # The way to the broker that this setting names is another check.
    try:
        yield Finding(Check.BROKER, Level.NOTE, f"`lippmann up` starts {find_server()}")
    except FarmFailed as error:
        yield Finding(Check.BROKER, missing, f"{error.message}; `lippmann up` starts no farm without it")


def _disk(data_dir: Path) -> Finding:
    folder = data_dir.absolute()
    while not folder.exists():
        folder = folder.parent
    if not os.access(folder, os.W_OK):
        return Finding(Check.DISK, Level.WARNING, f"expected a folder that can be written, got {folder}")
    free = shutil.disk_usage(folder).free
    text = f"{size_text(free)} are free for {data_dir}"
    if free < LITTLE_BYTES:
        return Finding(Check.DISK, Level.WARNING, f"only {text}; --data-dir takes another disk")
    return Finding(Check.DISK, Level.NOTE, text)


def _store_owner(data_dir: Path) -> Iterator[Finding]:
    was = os.umask(0o077)
    os.umask(was)
    keep_private()  # as a worker does
    try:
        check_owner(data_dir / ARTIFACTS)
    except StoreUnavailable as error:
        yield Finding(Check.STORE, Level.WARNING, error.message)
    finally:
        os.umask(was)


def _cores_and_gpu() -> Finding:
    cores = len(os.sched_getaffinity(0))
    gpu = next((device for device in _GPU_DEVICES if Path(device).exists()), None)
    text = "there is no GPU" if gpu is None else f"there is a GPU ({gpu}); Mitsuba alone uses one, if it is of NVIDIA"
    return Finding(Check.GPU, Level.NOTE, f"{cores} cores render; {text}")


def _extras() -> Iterator[Finding]:
    from lippmann.terminal.extras import how_to_install

    for package, extra, without in _EXTRAS:
        if importlib.util.find_spec(package) is None:
            message = f"{package} is not installed, so {without}; `{how_to_install(extra)}` installs it"
            yield Finding(Check.PACKAGES, Level.NOTE, message)
