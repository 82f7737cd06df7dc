"""The command `lippmann`: its sub-commands, and the one place where errors become messages and exit codes.

=====  =============================================================================================
exit   meaning
=====  =============================================================================================
0      The command did what was asked. `up`, `serve` and `worker` were stopped by the user.
1      The job failed or was cancelled, or the service or this machine could not do it. `doctor` found something.
2      The input is invalid: an option, a job file, a field of a job, a folder or a port.
3      The service does not answer.
4      There is no key, the key is not known, or its role does not permit the operation.
5      `fetch` brought the files that there are, and some files of the job are missing.
130    The user pressed Ctrl-C.
=====  =============================================================================================
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from importlib.metadata import version
from typing import Annotated, Any

import typer

from lippmann.cli.commands import design, docs, lens, paper, preview
from lippmann.cli.commands.client import files, job_actions, jobs, scenes
from lippmann.cli.commands.farms import backup, doctor, farm, keys, top, workers
from lippmann.cli.commands.images import (
    coding_study,
    compare,
    depth,
    export,
    import_sheets,
    observe,
    orthoscopic,
    views,
)
from lippmann.cli.exit_codes import ExitCode, exit_code_of
from lippmann.cli.options import with_context
from lippmann.cli.plain_help import PlainGroup, use_plain_help
from lippmann.cli.usage_errors import usage_error_text
from lippmann.errors import InputNote, LippmannError
from lippmann.job.fields.old_names import rename_settings
from lippmann.terminal.output import print_any_path, shown

app = typer.Typer(
    name="lippmann",
    cls=PlainGroup,
    help="A render farm for integral photography and integral videography.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)
COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    "Run a farm": {
        "up": farm.up,
        "demo": farm.demo,
        "serve": farm.serve,
        "worker": farm.worker,
        "status": farm.status,
        "top": top.top,
    },
    "Keep a farm": {
        "backup": backup.backup,
        "restore": backup.restore,
        "migrate": backup.migrate,
        "doctor": doctor.doctor,
    },
    "Jobs": {
        "submit": jobs.submit,
        "jobs": jobs.jobs,
        "show": jobs.show,
        "tasks": jobs.tasks,
        "logs": jobs.logs,
        "watch": jobs.watch,
        "fetch": files.fetch,
        "link": files.link,
        "cancel": job_actions.cancel,
        "pause": job_actions.pause,
        "resume": job_actions.resume,
        "retry": job_actions.retry,
        "repair": job_actions.repair,
        "skip": job_actions.skip,
        "priority": job_actions.priority,
        "rm": job_actions.remove,
    },
    "Scenes": {"capture": scenes.capture, "preview": preview.preview},
    "Integral images": {
        "import": import_sheets.import_sheets,
        "orthoscopic": orthoscopic.orthoscopic,
        "view": views.view,
        "refocus": views.refocus,
        "observe": observe.observe,
        "export": export.export,
        "depth": depth.depth,
        "compare": compare.compare,
        "coding-study": coding_study.coding_study,
    },
    "Optics": {"design": design.design, "lens": lens.lens, "calibration-sheet": design.calibration_sheet},
    "Help": {"docs": docs.docs},
}


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"lippmann {version('lippmann')}")
        raise typer.Exit


@app.callback()
def _root(
    _version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version.")
    ] = False,
) -> None:
    """Run one of the commands."""


for panel, commands in COMMANDS.items():
    for name, command in commands.items():
        app.command(name, rich_help_panel=panel)(with_context(command))
app.command("views", hidden=True)(with_context(import_sheets.views))
app.add_typer(scenes.app, name="scenes", rich_help_panel="Scenes")
app.add_typer(workers.app, name="workers", rich_help_panel="Run a farm")
app.add_typer(keys.app, name="keys", rich_help_panel="Run a farm")
app.add_typer(paper.app, name="paper", rich_help_panel="Optics")
use_plain_help(app)


def main() -> None:
    """Run the command; a mistake of the user or a failure of the machine never shows a traceback."""
    print_any_path()
    warnings.showwarning = _print_warning
    for note in rename_settings(os.environ):
        warnings.warn(note, FutureWarning, stacklevel=1)
    try:
        code = app(standalone_mode=False)
    except typer.TyperException as error:
        print(usage_error_text(error), file=sys.stderr)
        sys.exit(ExitCode.BAD_INPUT)
    except LippmannError as error:
        sys.exit(_print_error(error.message, exit_code_of(error)))
    except KeyboardInterrupt:
        sys.exit(_print_error("interrupted", ExitCode.INTERRUPTED))
    except OSError as error:
        what = error.filename or "a file"
        message = f"expected to read or write {what}, got: {error.strerror}" if error.strerror else str(error)
        sys.exit(_print_error(message or type(error).__name__, ExitCode.FAILED))
    sys.exit(code or ExitCode.DONE)


def _print_warning(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Print a warning for users as one line, and any other as Python does."""
    if issubclass(category, FutureWarning | InputNote):
        print(shown(f"note: {message}"), file=sys.stderr)
    else:
        print(warnings.formatwarning(message, category, *where[:2]), file=sys.stderr, end="")


def _print_error(message: str, code: ExitCode) -> int:
    print(shown(f"lippmann: {message}"), file=sys.stderr)
    return int(code)


if __name__ == "__main__":
    main()
