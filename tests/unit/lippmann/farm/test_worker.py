import resource

import pytest

from lippmann.descriptors import MOST_DESCRIPTORS
from lippmann.errors import PovrayMissing
from lippmann.farm.worker import run_worker, worker_arguments
from worker.engines.povray.version import check_povray


def test_a_worker_talks_to_nobody_but_the_broker() -> None:
    assert worker_arguments(name="host-1") == [
        "worker",
        "--pool",
        "prefork",
        "--hostname",
        "host-1",
        "--loglevel",
        "INFO",
        "-O",
        "fair",
        "--without-gossip",
        "--without-mingle",
        "--without-heartbeat",
    ]


def test_a_worker_raises_its_limit_of_open_files(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LIPPMANN_WORKER_NAME", "LIPPMANN_SLOTS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(name, "1")  # which `run_worker` changes
    found: list[int] = []
    monkeypatch.setattr(
        "worker.app.app.worker_main", lambda _: found.append(resource.getrlimit(resource.RLIMIT_NOFILE)[0])
    )
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, MOST_DESCRIPTORS) // 2, hard))
    try:
        run_worker(slots=1)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert found == [min(hard, MOST_DESCRIPTORS)]


def test_a_machine_without_povray_is_told_what_to_install() -> None:
    with pytest.raises(PovrayMissing, match="expected POV-Ray as 'povray-9' on PATH, got none; install it"):
        check_povray("povray-9")
