import pytest

from lippmann.errors import PovrayMissing
from lippmann.farm.worker import worker_arguments
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


def test_a_machine_without_povray_is_told_what_to_install() -> None:
    with pytest.raises(PovrayMissing, match="expected POV-Ray as 'povray-9' on PATH, got none; install it"):
        check_povray("povray-9")
