"""The units of deploy/systemd: systemd accepts them, and they agree with the command, the settings and the runbook."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
import typer.main
from pydantic import BaseModel

from lippmann.cli.main import app
from lippmann.farm.joining import FOLDER
from lippmann.key_file import FORBIDDEN_MODE
from service.main import SHUTDOWN_S
from service.settings import Settings
from tests.farm import LIPPMANN
from tests.repository import DOCS, ROOT
from worker.app import EXIT_REFUSED
from worker.liveness import EXIT_STUCK
from worker.settings import WorkerSettings

HERE = ROOT / "deploy/systemd"
UNITS: dict[str, type[BaseModel]] = {"service": Settings, "worker": WorkerSettings}
INSTALLED = "/opt/lippmann/bin/lippmann"
LANDLOCK = {"landlock_create_ruleset", "landlock_add_rule", "landlock_restrict_self"}

in_every_unit = pytest.mark.parametrize("unit", UNITS)


def options_of(unit: str) -> dict[str, list[str]]:
    """Return the values of each option of a unit, in their order."""
    found: dict[str, list[str]] = {}
    for line in (HERE / f"lippmann-{unit}.service").read_text().splitlines():
        if line and not line.startswith(("#", "[")):
            name, _, value = line.partition("=")
            found.setdefault(name, []).append(value)
    return found


def one(unit: str, name: str) -> str:
    (value,) = options_of(unit)[name]
    return value


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not on this machine")
@in_every_unit
def test_systemd_accepts_the_unit(unit: str, tmp_path: Path) -> None:
    copy = tmp_path / f"lippmann-{unit}.service"
    copy.write_text((HERE / copy.name).read_text().replace(INSTALLED, str(LIPPMANN)))
    ran = subprocess.run(["systemd-analyze", "verify", copy], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")


@in_every_unit
def test_the_command_is_one_that_lippmann_has(unit: str) -> None:
    program, *words = one(unit, "ExecStart").split()
    assert program == INSTALLED
    (name,) = words
    assert name in typer.main.get_group(app).commands


@in_every_unit
def test_every_variable_is_a_setting_or_an_option_of_the_command(unit: str) -> None:
    (name,) = one(unit, "ExecStart").split()[1:]
    command = typer.main.get_group(app).commands[name]
    known = {f"LIPPMANN_{field.upper()}" for field in UNITS[unit].model_fields}
    known |= {str(parameter.envvar) for parameter in command.params if parameter.envvar}
    assert {value.partition("=")[0] for value in options_of(unit)["Environment"]} <= known
    assert one(unit, "EnvironmentFile") == f"/etc/lippmann/{unit}.env"


@in_every_unit
def test_the_runbook_tells_to_make_every_file_of_the_unit(unit: str) -> None:
    page = (DOCS / "runbook.md").read_text()
    files = set(re.findall(r"/etc/lippmann/[\w.-]+", (HERE / f"lippmann-{unit}.service").read_text()))
    assert len(files) >= 3
    for file in files:
        assert f"{file}\n" in page or f"{file} " in page, file
    (mode,) = set(re.findall(r"install -m (\d+) -o root -g lippmann", page))
    assert int(mode, 8) & FORBIDDEN_MODE == 0, "a key file may be read by its group and by nobody else"


@in_every_unit
def test_a_unit_gains_no_rights_and_writes_its_folder_alone(unit: str) -> None:
    assert one(unit, "User") == one(unit, "Group") == "lippmann"
    for name in ("NoNewPrivileges", "ProtectHome", "PrivateTmp", "PrivateDevices", "ProtectKernelModules"):
        assert one(unit, name) == "yes"
    assert one(unit, "ProtectSystem") == "strict"
    assert one(unit, "CapabilityBoundingSet") == ""
    assert one(unit, "Restart") == "always"
    assert one(unit, "StartLimitIntervalSec") == "0"
    # Otherwise the children of a worker get SIGTERM too, and die with their attempts.
    assert one(unit, "KillMode") == "mixed"
    assert float(one(unit, "TimeoutStopSec")) >= 2 * SHUTDOWN_S


def test_a_worker_has_the_time_to_finish_what_it_renders() -> None:
    given = dict(value.split("=", 1) for value in options_of("worker")["Environment"])
    assert float(one("worker", "TimeoutStopSec")) >= float(given["LIPPMANN_DRAIN_S"]) + 30


def test_the_sandbox_of_a_worker_works_in_its_unit() -> None:
    allowed = set(one("worker", "SystemCallFilter").split())
    # bubblewrap mounts, and Landlock has calls that @system-service of systemd 252 lacks; each fails without.
    assert allowed == {"@system-service", "@mount", *LANDLOCK}
    assert "RestrictNamespaces" not in options_of("worker"), "bubblewrap makes namespaces"
    assert "AF_NETLINK" in one("worker", "RestrictAddressFamilies").split(), "bubblewrap sets up a loopback device"
    # A cgroup for each task: the worker writes in the tree of groups.
    assert one("worker", "Delegate") == "memory pids"
    assert "ProtectControlGroups" not in options_of("worker")


def test_a_worker_sees_of_the_service_nothing_but_the_artifacts() -> None:
    assert one("worker", "TemporaryFileSystem") == "/var/lib/lippmann"
    # The folder above them is of root, so a worker makes no other: what a join file brings needs a folder too.
    folders = ["artifacts", "scratch", FOLDER]
    assert one("worker", "StateDirectory").split() == [f"lippmann/{name}" for name in folders]
    assert one("worker", "BindPaths").split() == [f"/var/lib/lippmann/{name}" for name in folders]
    theirs = set(re.findall(r"/etc/lippmann/[\w.-]+", (HERE / "lippmann-service.service").read_text()))
    hidden = {path.lstrip("-") for path in one("worker", "InaccessiblePaths").split()}
    assert theirs - hidden == {"/etc/lippmann/order.key"}, "both have the key of messages"


def test_a_worker_that_is_stuck_is_started_again_and_one_that_is_shut_out_is_not() -> None:
    assert f"ends by itself, with {EXIT_STUCK}," in (HERE / "lippmann-worker.service").read_text()
    assert one("worker", "RestartPreventExitStatus") == str(EXIT_REFUSED)
