"""The command `lippmann`, the Python client and the one-machine farm. Wires the rest together; nothing imports it.

main            the command: every sub-command, errors and exit codes
commands        the sub-commands: options in, words out
talk            what a command says: JSON for programs, text for people
progress        how far a job is: a bar on a terminal, plain lines in a pipe
table           columns of text
job_file        job files and `--set`
address         where the service is, and the key to it
client          the Python client: `from lippmann import Client`
follow_job      a job watched until it ends
fetch_job       a job's files brought here
demo            the paper's integral video, from nothing
capture_here    one frame without a farm
compare_here    two integral images, or folders of them, compared
master_file     an orthoscopic master from disk
view_here       views and refocused pictures of it
design_here     what a job will give, before it is rendered
lens_file       imaging lenses from files
paper           the paper's experiments, each a command
bundle_file     scene bundles from disk
writable        whether a folder can be written
parts           what the service is given: store, pictures, scenes
serve           the service as a process
listen          the address that a service listens on
worker_process  a worker as a process
supervisor      the one-machine farm: broker, service and workers that live and end together
errors          what a command cannot do, and the exit codes
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lippmann.client import Client

__all__ = ["Client"]


def __getattr__(name: str) -> Any:
    # Late, so that `lippmann --help` does not wait for the HTTP library.
    if name == "Client":
        from lippmann.client import Client

        return Client
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
