"""The answer of the service to a job file that is not submitted yet."""

from __future__ import annotations

from service.schemas.answer import Answer
from service.schemas.design import Design
from service.schemas.problem import FieldError


class AskedLimit(Answer):
    """The share of a limit that a job would use."""

    name: str
    """The name of the limit, as in `limits` of a key."""
    used: float
    """The amount that the job asks for; of a limit of the owner, all that the owner would have with the job."""
    limit: float
    source: str
    """Who sets the limit: a setting of the farm, or the key of the request if that is lower."""
    exceeded: bool
    """True if a submission is refused because of it."""


class JobCheck(Answer):
    """The answer to a job file: what is wrong with it, its design, and how much of the limits it uses."""

    detail: str
    """Why the job has no design; empty if it has one, and for imported integral images."""
    errors: tuple[FieldError, ...]
    """The fields at fault, limits included; empty if nothing in the job file is refused."""
    design: Design | None
    """The design at the first frame; null if the job is invalid, and for imported integral images."""
    limits: tuple[AskedLimit, ...]
    """The limits that a submission is checked against; empty if the job file is invalid."""
