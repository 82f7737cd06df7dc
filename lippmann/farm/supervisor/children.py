"""The command lines of the three children."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path

from lippmann.farm.supervisor import broker
from lippmann.farm.supervisor.child import ChildPlan
from lippmann.farm.supervisor.plan import FarmPlan

BROKER, SERVICE, WORKER = "broker", "service", "worker"

SERVICE_READY = "The service listens"
"""The line that `lippmann serve` prints when it accepts requests."""
WORKER_READY = " ready."
"""The text that Celery prints when it accepts orders."""

OF_OTHER_FARMS = frozenset(
    {
        "LIPPMANN_COORDINATOR",
        "LIPPMANN_JOIN_FILE",
        "LIPPMANN_REDIS_CA_FILE",
        "LIPPMANN_REDIS_PASSWORD_FILE",
        "LIPPMANN_WORKER_KEY_FILE",
    }
)
"""The settings of a farm of several machines, which a shell may have for it. This farm has one service, one worker and
a broker on a socket, without a password."""

_LIPPMANN = (sys.executable, "-P", "-m", "lippmann.cli.main")
# With -P, a folder `worker` in the current folder is not imported instead of ours.


def child_plans(plan: FarmPlan, *, server: Path, socket: Path, listen_fd: int, url: str) -> tuple[ChildPlan, ...]:
    """Return the children, in the order in which they start."""
    environment = farm_environment(plan, socket=socket, url=url)
    # The worker keeps its name when it is started again, which tells the service that its attempts ended.
    name = os.environ.get("LIPPMANN_WORKER_NAME") or platform.node() or WORKER
    return (
        ChildPlan(
            name=BROKER,
            command=tuple(broker.server_command(server, socket=socket, folder=plan.broker_dir)),
            ready_text=broker.READY,
            grace_s=5.0,
        ),
        ChildPlan(
            name=SERVICE,
            command=(*_LIPPMANN, "serve", "--listen-fd", str(listen_fd), "--key-file", str(plan.key_file.resolve())),
            ready_text=SERVICE_READY,
            grace_s=8.0,
            environment=environment,
            kept_back=OF_OTHER_FARMS,
            passed_descriptors=(listen_fd,),
        ),
        ChildPlan(
            name=WORKER,
            command=(*_LIPPMANN, "worker"),
            ready_text=WORKER_READY,
            grace_s=12.0,
            environment={
                **environment,
                "LIPPMANN_WORKER_NAME": name,
                **({"LIPPMANN_NEEDS_POVRAY": "false"} if plan.without_povray else {}),
            },
            kept_back=OF_OTHER_FARMS,
        ),
    )


def farm_environment(plan: FarmPlan, *, socket: Path, url: str) -> Mapping[str, str]:
    """Return the environment of the service and the worker."""
    return {
        "LIPPMANN_DATA_DIR": str(plan.data_dir.resolve()),
        "LIPPMANN_REDIS_URL": f"unix://{socket}",
        "LIPPMANN_PUBLIC_URL": plan.public_url or url,
        "LIPPMANN_SLOTS": str(plan.slots),
        "PYTHONUNBUFFERED": "1",
    }
