"""What a machine has and lacks for a farm."""

from __future__ import annotations

import os
import shutil
import sys
from collections import namedtuple
from pathlib import Path

import pytest
from typer.testing import CliRunner

from lippmann.cli import main
from lippmann.errors import FarmFailed
from lippmann.farm import this_machine
from lippmann.farm.this_machine import examine_machine
from lippmann.terminal.extras import how_to_install
from service.doctor.finding import Check, Finding, Level
from worker.engines.mitsuba.version import Found, Missing

Usage = namedtuple("Usage", "total used free")


def _found(data_dir: Path, *, has_farm: bool = False) -> dict[Check, Finding]:
    return {one.check: one for one in examine_machine(data_dir, has_farm=has_farm)}


@pytest.fixture(autouse=True)
def no_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    """The trial of the sandbox has tests of its own."""
    monkeypatch.setattr(this_machine, "_sandbox", lambda _: Finding(Check.SANDBOX, Level.NOTE, "a sandbox"))
    monkeypatch.delenv("LIPPMANN_REDIS_URL", raising=False)


@pytest.mark.parametrize(("has_farm", "level"), [(False, Level.WARNING), (True, Level.NOTE)])
def test_what_is_missing_comes_with_the_way_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_farm: bool, level: Level
) -> None:
    def find_server() -> Path:
        raise FarmFailed("expected a server, got none: install one")

    monkeypatch.setenv("LIPPMANN_POVRAY", "povray-of-the-future")
    monkeypatch.setattr(this_machine, "find_server", find_server)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    found = _found(tmp_path, has_farm=has_farm)
    assert (found[Check.POVRAY].level, found[Check.BROKER].level) == (level, level)
    assert "apt-get install povray povray-includes" in found[Check.POVRAY].message
    assert "install one; `lippmann up` starts no farm without it" in found[Check.BROKER].message
    assert "`pip install 'lippmann[oidc]'`" in found[Check.PACKAGES].message


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (Found("3.9.1", "llvm_ad_rgb"), "Mitsuba 3.9.1 works, by its variant llvm_ad_rgb"),
        (
            Found("3.9.1", "llvm_ad_rgb", note="no driver"),
            "Mitsuba 3.9.1 works, by its variant llvm_ad_rgb; not on the GPU: no driver",
        ),
        (Missing("no LLVM 16"), "no LLVM 16; without it, scenes of Mitsuba are not rendered on this machine"),
    ],
)
def test_mitsuba_works_or_the_reason_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: Found | Missing, message: str
) -> None:
    monkeypatch.setattr(this_machine, "mitsuba_version", lambda: found)
    assert "LIPPMANN_MITSUBA is off" in _found(tmp_path)[Check.MITSUBA].message
    monkeypatch.setenv("LIPPMANN_MITSUBA", "auto")
    assert _found(tmp_path)[Check.MITSUBA].message == message


def test_in_an_environment_of_pipx_the_advice_is_a_command_of_pipx(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert how_to_install("plots") == "pip install 'lippmann[plots]'"
    (tmp_path / "pipx_metadata.json").write_text("{}")
    assert how_to_install("plots") == "pipx runpip lippmann install 'lippmann[plots]'"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives a folder to another user")
def test_a_store_of_another_user_is_warned_about(tmp_path: Path) -> None:
    (tmp_path / "artifacts").mkdir()
    assert Check.STORE not in _found(tmp_path, has_farm=True)
    os.chown(tmp_path / "artifacts", 65_533, 65_533)
    before = os.umask(0o022)
    try:
        found = _found(tmp_path, has_farm=True)[Check.STORE]
        assert os.umask(0o022) == 0o022
    finally:
        os.umask(before)
    assert found.level is Level.WARNING
    assert "expected a worker of the user 65533" in found.message


def test_a_disk_that_is_nearly_full_and_one_that_cannot_be_written_are_warned_about(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _found(tmp_path / "not" / "there")[Check.DISK].level in (Level.NOTE, Level.WARNING)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1, 1, 1_500_000_000))
    assert "only 1.5 GB are free" in _found(tmp_path)[Check.DISK].message
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1, 1, 10**12))
    assert _found(tmp_path)[Check.DISK] == Finding(Check.DISK, Level.NOTE, f"1.0 TB are free for {tmp_path}")
    monkeypatch.setattr("os.access", lambda *_: False)
    assert _found(tmp_path)[Check.DISK].level is Level.WARNING


def test_the_broker_of_the_settings_needs_no_program_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIPPMANN_REDIS_URL", "redis://elsewhere")
    assert Check.BROKER not in _found(tmp_path)


def test_the_doctor_examines_a_machine_without_a_farm_and_refuses_a_folder_that_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LIPPMANN_DATA_DIR", raising=False)
    ended = CliRunner().invoke(main.app, ["doctor"])
    assert ended.stdout.startswith("note: farm: there is no farm in data/; `lippmann up` starts one")
    assert "povray: " in ended.stdout
    assert not list(tmp_path.iterdir())
    for arguments in (["--data-dir", "elsewhere"], ["--repair"]):
        monkeypatch.setattr(sys, "argv", ["lippmann", "doctor", *arguments])
        with pytest.raises(SystemExit) as refused:
            main.main()
        assert (refused.value.code, "without artifacts/" in capsys.readouterr().err) == (2, True)
