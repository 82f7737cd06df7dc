"""The supervisor as a process: `python -m lippmann.farm.supervisor PLAN`, started by `supervisor.farm`."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path

from lippmann.client.address import Address, remove_farm_file, write_farm_file
from lippmann.errors import BadInput, FarmFailed, LippmannError
from lippmann.farm.listening import listening_socket, url_of
from lippmann.farm.supervisor import broker, children
from lippmann.farm.supervisor.child import Child
from lippmann.farm.supervisor.descendants import adopt_orphans
from lippmann.farm.supervisor.folder import data_folder
from lippmann.farm.supervisor.logs import BoundedLog
from lippmann.farm.supervisor.plan import FarmPlan
from lippmann.farm.supervisor.supervisor import Supervisor, send_event
from lippmann.private_files import keep_private


def main() -> int:
    """Run the farm in the first argument."""
    adopt_orphans()
    keep_private()
    try:
        _run(FarmPlan.from_json(sys.argv[1]))
    except LippmannError as error:
        send_event("failed", message=error.message, code=error.code)
        return 1
    except OSError as error:
        send_event("failed", message=f"expected to run a farm, got: {error}", code=FarmFailed.code)
        return 1
    return 0


def _run(plan: FarmPlan) -> None:
    server = broker.find_server()
    with ExitStack() as stack:
        stack.enter_context(data_folder(plan.data_dir))
        listening = stack.enter_context(listening_socket(plan.host, plan.port))
        socket = broker.socket_path(plan.broker_dir)
        _make_folders(plan, socket)
        # The lock shows that no other farm runs here, so an existing socket or farm file is a leftover.
        socket.unlink(missing_ok=True)
        stack.callback(broker.clear_socket, socket, plan.broker_dir)
        remove_farm_file(plan.data_dir)
        stack.callback(remove_farm_file, plan.data_dir)
        url = url_of(listening)
        plans = children.child_plans(plan, server=server, socket=socket, listen_fd=listening.fileno(), url=url)
        farm = [Child(one, BoundedLog(plan.log_dir / f"{one.name}.log")) for one in plans]
        needed = (children.BROKER, children.SERVICE)
        Supervisor(farm).run(needed=needed, when_ready=lambda: _announce(plan, url))


def _make_folders(plan: FarmPlan, socket: Path) -> None:
    try:
        broker.private_folder(plan.broker_dir)
        broker.private_folder(socket.parent)
    except OSError as error:
        raise BadInput(f"expected a data folder that can be written, got {plan.data_dir}: {error}") from error


def _announce(plan: FarmPlan, url: str) -> None:
    address = Address(url=url, key=plan.key_file.read_text().strip())
    write_farm_file(plan.data_dir, address)
    send_event("ready", url=url, key=address.key)


if __name__ == "__main__":
    sys.exit(main())
