"""What several sub-commands take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RECONNECT_S = 60.0
"""How long a command that waits for a job puts up with a service that is away."""

AsJson = Annotated[bool, typer.Option("--json", help="Say it as JSON on stdout, for programs.")]
Url = Annotated[
    str | None, typer.Option("--url", envvar="LIPPMANN_URL", help="The service; else the farm of --data-dir.")
]
Key = Annotated[str | None, typer.Option("--key", envvar="LIPPMANN_KEY", help="A key to the service.")]
DataDir = Annotated[Path, typer.Option("--data-dir", envvar="LIPPMANN_DATA_DIR", help="The farm's data folder.")]
JobId = Annotated[str, typer.Argument(help="The job's id.", metavar="JOB")]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", help="Set a field of the job: rig.px_per_lens=4; may be repeated.", metavar="FIELD=VALUE"),
]

Source = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", help="A master: orthoscopic/0001.exr, or device/0001.exr; a folder of them; or a job."
    ),
]
Frame = Annotated[
    int | None, typer.Option("--frame", min=1, help="Of the folder or the job; the first one when not said.")
]

DATA_DIR = Path("data")
