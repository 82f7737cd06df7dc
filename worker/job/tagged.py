"""Fields of which a job may write one of several forms: the form is told by what was written, not by trying all.

The tag of a form stands in pydantic's places of errors, in brackets; `untagged` takes it out again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from pydantic import BaseModel, Discriminator


def told_by(form_of: Callable[[Any], str]) -> Discriminator:
    """Return a discriminator that brackets the tag which `form_of` tells from what was written."""

    def form(value: Any) -> str:
        return f"({form_of(value.model_dump() if isinstance(value, BaseModel) else value)})"

    return Discriminator(form)


def untagged(place: Iterable[Any]) -> tuple[str, ...]:
    """Return the place of an error without tags.

    >>> untagged(("rig", "imaging_lens", "(scaled)", "focal_length_mm"))
    ('rig', 'imaging_lens', 'focal_length_mm')
    """
    return tuple(str(part) for part in place if not str(part).startswith("("))
