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
import_here     integral images from elsewhere, taken into the chain
orthoscopic_here   a pseudoscopic sheet made orthoscopic, by the half-turn or by SPOC
compare_here    two integral images, or folders of them, compared
coding_study    what codecs make of an integral video: rate and distortion
study_here      such a study of frames on disk: numbers and curves
lent_master     the master to look at: a file, a frame of a folder or of a job
job_masters     masters of a job, brought here for as long as they are needed
master_file     an orthoscopic master from disk
files_footage   masters on disk as what outputs are made of
said_lenses     the lenses over a picture, where no header says them
shown_display   the display that a master would be shown on
numbers         numbers as options carry them
picture_size    in which size a picture is written
view_here       views of it
refocus_here    refocused pictures of it
depth_here      the depth of its views
observe_here    what eyes see of its display
export_here     outputs made of masters here
calibration_here   a calibration sheet without a job
design_here     what a job will give, before it is rendered
lens_file       imaging lenses from files
plot            axes, points and lines in one style
paper           the paper's experiments, each a command
bundle_file     scene bundles from disk
writable        whether a folder can be written
parts           what the service is given: store, pictures, scenes
serve           the service as a process
listen          the address that a service listens on
log_file        where a process writes its log
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
