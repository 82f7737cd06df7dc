"""Filling in the templates of .pov files."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from povtemplates.catalogue import RIGS_FOLDER


def write_capture(**fields: Any) -> str:
    """Return the text of rigs/capture.pov.j2 with its fields filled in; a missing field is an error."""
    return _environment().get_template("capture.pov.j2").render(fields)


def write_lens_image(**fields: Any) -> str:
    """Return the text of rigs/lens_image.pov.j2, a perspective camera with or without the imaging lens before it."""
    return _environment().get_template("lens_image.pov.j2").render(fields)


def write_camera_report(**fields: Any) -> str:
    """Return the text of rigs/camera_report.pov.j2, a picture in which POV-Ray reports the camera of a scene."""
    return _environment().get_template("camera_report.pov.j2").render(fields)


@cache
def _environment() -> Environment:
    # SDL is not HTML and needs no escaping. The fields are numbers and checked names.
    return Environment(  # noqa: S701
        loader=FileSystemLoader(RIGS_FOLDER), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
