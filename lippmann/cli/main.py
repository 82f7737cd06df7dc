"""The command: every sub-command, and the one place where errors become messages and exit codes.

=====  =============================================================================================
exit   means
=====  =============================================================================================
0      it did what was asked; `up` and `serve`: ended because they were told to
1      the job failed or was cancelled; or the service or this machine could not do it
2      what was asked cannot be: an option, a job file, a field, a folder, a port
3      the service does not answer
4      no key, a key that is not known, or one whose role is too low
130    Ctrl-C
=====  =============================================================================================
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable

import typer

from lippmann.cli.commands import calibration_sheet as calibration
from lippmann.cli.commands import (
    capture,
    coding_study,
    compare,
    depth,
    design,
    export,
    farm,
    jobs,
    keys,
    lens,
    observe,
    orthoscopic,
    paper,
    scenes,
    views,
)
from lippmann.cli.commands import import_sheets as foreign
from lippmann.cli.exit_codes import ExitCode, exit_code_of
from lippmann.errors import LippmannError

app = typer.Typer(
    name="lippmann",
    help="A render farm for integral photography and integral videography.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
COMMANDS: dict[str, tuple[Callable[..., None], ...]] = {
    "Run a farm": (farm.up, farm.demo, farm.serve, farm.worker),
    "Jobs": (
        jobs.submit,
        jobs.jobs,
        jobs.show,
        jobs.watch,
        jobs.fetch,
        jobs.cancel,
        jobs.pause,
        jobs.resume,
        jobs.retry,
    ),
    "Scenes": (capture.capture,),
    "Integral images": (
        foreign.views,
        orthoscopic.orthoscopic,
        views.view,
        views.refocus,
        observe.observe,
        export.export,
        depth.depth,
        compare.compare,
        coding_study.coding_study,
    ),
    "Optics": (design.design, lens.lens, calibration.calibration_sheet),
}
for panel, commands in COMMANDS.items():
    for command in commands:
        app.command(rich_help_panel=panel)(command)
app.add_typer(scenes.app, name="scenes", rich_help_panel="Scenes")
app.add_typer(keys.app, name="keys", rich_help_panel="Run a farm")
app.add_typer(paper.app, name="paper", rich_help_panel="Optics")


def main() -> None:
    """Run the command; never shows a traceback for what a user can do something about."""
    try:
        app()
    except LippmannError as error:
        sys.exit(_say(error.message, exit_code_of(error)))
    except KeyboardInterrupt:
        sys.exit(_say("interrupted", ExitCode.INTERRUPTED))
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM):
            raise
        sys.exit(_say(f"expected to write {error.filename or 'a file'}, got: {error.strerror}", ExitCode.FAILED))


def _say(message: str, code: ExitCode) -> int:
    print(f"lippmann: {message}", file=sys.stderr)
    return int(code)


if __name__ == "__main__":
    main()
