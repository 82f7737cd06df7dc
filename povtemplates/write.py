"""A rig's head, filled in."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from povtemplates.catalogue import RIGS_FOLDER


def write_capture(**fields: Any) -> str:
    """Return the .pov text of rigs/capture.pov.j2; a field that is missing is an error."""
    return _environment().get_template("capture.pov.j2").render(fields)


def write_lens_image(**fields: Any) -> str:
    """Return the .pov text of rigs/lens_image.pov.j2: a camera with or without the imaging lens before it."""
    return _environment().get_template("lens_image.pov.j2").render(fields)


@cache
def _environment() -> Environment:
    # SDL is not HTML: nothing to escape. What goes in is numbers, and names that were checked.
    return Environment(  # noqa: S701
        loader=FileSystemLoader(RIGS_FOLDER), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
