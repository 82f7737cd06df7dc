"""The engines of this machine: whether a command may start what renders with them."""

from __future__ import annotations

import os

from lippmann.terminal.output import Output


def check_povray() -> None:
    """Check that POV-Ray is there.

    Raises
    ------
    PovrayMissing
        If it is not.
    """
    from worker.engines.povray.version import check_povray

    check_povray(os.environ.get("LIPPMANN_POVRAY", "povray"))


def has_povray() -> bool:
    """Return whether POV-Ray is there."""
    from lippmann.errors import PovrayMissing

    try:
        check_povray()
    except PovrayMissing:
        return False
    return True


def check_mitsuba() -> None:
    """Check that Mitsuba works.

    Raises
    ------
    BadInput
        If it does not; the message says what to install.
    """
    from lippmann.errors import BadInput
    from worker.engines.mitsuba.version import Missing, mitsuba_version

    found = mitsuba_version()
    if isinstance(found, Missing):
        raise BadInput(f"--engine mitsuba: {found.reason}")


def has_mitsuba() -> bool:
    """Return whether a worker started here would render with Mitsuba."""
    from worker.engines.mitsuba.version import Found, mitsuba_version
    from worker.settings import WorkerSettings

    return WorkerSettings().mitsuba != "off" and isinstance(mitsuba_version(), Found)


def may_render(output: Output) -> bool:
    """Return whether POV-Ray is there; a farm without it says what it can do."""
    from lippmann.errors import PovrayMissing

    try:
        check_povray()
    except PovrayMissing as error:
        output.note(f"note: {error.message}")
        output.note(
            "note: without it, scenes of POV-Ray wait; integral images that exist are imported, viewed and exported"
        )
        return False
    return True
