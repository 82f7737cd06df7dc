"""The examination of this machine and of a farm."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.exit_codes import ExitCode
from lippmann.cli.options import DATA_DIR, DataDir
from lippmann.errors import BadInput
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from service.doctor.examine import Diagnosis
    from service.doctor.finding import Finding


def doctor(
    repair: Annotated[
        bool, typer.Option("--repair", help="Repair what can be repaired. The farm may run meanwhile.")
    ] = False,
    deep: Annotated[
        bool,
        typer.Option("--deep", help="Read every artifact and compare its digest. By default, only sizes are compared."),
    ] = False,
    adopt_store: Annotated[
        bool,
        typer.Option(
            "--adopt-store",
            help="Take the folder that is now in the store's place as the store of this farm, because the old one is "
            "lost for ever.",
        ),
    ] = False,
    data_dir: DataDir = DATA_DIR,
    *,
    output: Output,
) -> None:
    """Examine this machine and a farm, and repair the farm.

    Of a farm, the database, the store and the settings are examined, also while it runs.

    Without a farm, only the machine is examined: what it has, what it lacks, and how to get that. On a machine of
    workers alone, which has LIPPMANN_STORE_URL and no database, the ways to the store and to the broker are examined,
    too. LIPPMANN_DATABASE_URL names the database if it is
    not in the data folder. The exit code is 0 when nothing is wrong, and 1 when there are
    errors or warnings, after the repair if there was one.
    """
    from lippmann.farm.this_machine import examine_machine
    from service.doctor.examine import Diagnosis
    from service.doctor.finding import Check, Finding, Level
    from worker.store.opening import ARTIFACTS

    # The artifacts of a farm on a bucket are not in its data folder.
    has_bucket = bool(os.environ.get("LIPPMANN_STORE_URL"))
    has_farm = (data_dir / ARTIFACTS).is_dir() or has_bucket
    if has_bucket and not (os.environ.get("LIPPMANN_DATABASE_URL") or (data_dir / "lippmann.db").is_file()):
        if repair or deep or adopt_store:
            raise BadInput(f"expected LIPPMANN_DATABASE_URL or a database in {data_dir}, got neither")
        text = (
            f"there is no database in {data_dir}/ and no LIPPMANN_DATABASE_URL, as beside a worker; `lippmann doctor`"
            " with the settings of the service examines the farm"
        )
        found = Diagnosis((Finding(Check.FARM, Level.NOTE, text), *_ways_of_worker(data_dir)))
    elif has_farm:
        found = _farm(data_dir, repair=repair, deep=deep, adopt_store=adopt_store)
    elif data_dir != DATA_DIR or repair or deep or adopt_store or any(map(os.environ.get, _SETTINGS_OF_A_FARM)):
        raise BadInput(f"expected the data folder of a farm, got {data_dir} without {ARTIFACTS}/")
    else:
        text = f"there is no farm in {data_dir}/; `lippmann up` starts one, and --data-dir names another folder"
        found = Diagnosis((Finding(Check.FARM, Level.NOTE, text),))
    found = replace(found, findings=(*found.findings, *examine_machine(data_dir, has_farm=has_farm)))
    output.result(_data(found), _text(found))
    if not found.is_healthy:
        raise typer.Exit(ExitCode.FAILED)


_SETTINGS_OF_A_FARM = {"LIPPMANN_DATABASE_URL", "LIPPMANN_REDIS_URL", "LIPPMANN_STORE_URL"}
"""Whoever sets one of them means a farm, whose data folder is then the wrong one."""


def _ways_of_worker(data_dir: Path) -> Iterator[Finding]:
    """Examine the ways of a worker to the store and to the broker."""
    from service.doctor.broker import check_broker_of_worker
    from service.doctor.store import check_way_to_store
    from worker.settings import WorkerSettings
    from worker.store.opening import open_store

    settings = WorkerSettings(data_dir=data_dir)
    yield from check_way_to_store(open_store(settings))
    yield from check_broker_of_worker(settings)


def _farm(data_dir: Path, *, repair: bool, deep: bool, adopt_store: bool) -> Diagnosis:
    """Examine a farm, and repair it if wanted."""
    from service.db.engine import opened
    from service.doctor.broker import check_broker
    from service.doctor.examine import Diagnosis, Patient, examine, examine_and_repair
    from service.settings import Settings
    from service.store_identity import adopt_store as adopt
    from worker.store.opening import open_store

    settings = Settings(data_dir=data_dir)
    with opened(settings.database) as database:
        patient = Patient(database, open_store(settings), settings)
        if adopt_store:
            adopt(database, patient.store)
        if repair:
            found = examine_and_repair(patient, clock=time.time, by_content=deep)
        else:
            found = Diagnosis(examine(patient, now_s=time.time(), by_content=deep))
        return replace(found, findings=(*found.findings, *check_broker(settings, database)))


def _data(found: Diagnosis) -> dict[str, Any]:
    return {
        "healthy": found.is_healthy,
        "findings": [_finding(finding) for finding in found.findings],
        "repaired": [_finding(finding) for finding in found.repaired],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "check": finding.check.value,
        "level": finding.level.value,
        "job": finding.job_id,
        "tasks": list(finding.sequences),
        "message": finding.message,
        "repairable": finding.repairable,
    }


def _text(found: Diagnosis) -> str:
    lines = [*_lines("repaired", found.repaired), *_lines(None, found.findings)]
    bad = [finding for finding in found.findings if finding.is_bad]
    if not bad:
        return "\n".join([*lines, "Nothing is wrong."])
    can = sum(finding.repairable for finding in bad)
    advice = f" `lippmann doctor --repair` can repair {can} of them." if can and not found.repaired else ""
    return "\n".join([*lines, f"Findings: {len(bad)}.{advice}"])


def _lines(word: str | None, findings: Iterable[Finding]) -> Iterator[str]:
    for finding in findings:
        job = f"job {finding.job_id}: " if finding.job_id else ""
        yield f"{word or finding.level}: {finding.check}: {job}{finding.message}"
