"""The fields of a job that an earlier release does not know.

During an upgrade, services and workers of both releases run at the same time, and one of the earlier release may lead.
It refuses a field that it does not know. So what is stored leaves these fields out while they have their defaults, and
only a job that uses one needs the new release everywhere.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

from lippmann.job.spec import JobSpec

LATER_FIELDS = (
    "slots",
    "workers",
    "capture.bands",
    "capture.channels",
    "render.engine",
    "render.samples",
    "render.path_depth",
    "render.clamp",
)
"""The paths of the fields. A field stays here until no release that a farm is upgraded from lacks it."""


def later_defaults(spec: JobSpec) -> dict[str, Any]:
    """Return the later fields that have their defaults, as pydantic's `exclude` takes them.

    >>> later_defaults(JobSpec.model_validate({"scene": "fish", "slots": 2}))["render"]["engine"]
    True
    """
    excluded: dict[str, Any] = {}
    for path in LATER_FIELDS:
        *above, name = path.split(".")
        part = reduce(getattr, above, spec)
        if getattr(part, name) == type(part).model_fields[name].get_default(call_default_factory=True):
            reduce(lambda found, key: found.setdefault(key, {}), above, excluded)[name] = True
    return excluded
