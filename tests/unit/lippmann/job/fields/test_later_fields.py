"""A service or worker of the release before reads a job that uses nothing new."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from lippmann.job.fields.later_fields import LATER_FIELDS, later_defaults
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec

BEFORE = Path(__file__).with_name("fields_of_the_release_before.txt")
"""The fields of `ResolvedJob` at commit 5191796, as `fields_of` gives them."""


def models_in(kind: Any) -> Iterator[type[BaseModel]]:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    else:
        for one in get_args(kind):
            yield from models_in(one)


def fields_of(model: type[BaseModel], path: str = "", above: tuple[type[BaseModel], ...] = ()) -> Iterator[str]:
    """Yield the paths of all fields; those of an output have its kind in them."""
    for name, field in model.model_fields.items():
        yield path + name
        for inner in models_in(field.annotation):
            if inner not in above:
                kind = inner.model_fields.get("kind")
                part = f"{kind.default}." if kind is not None and kind.default and "output" in name else ""
                yield from fields_of(inner, f"{path}{name}.{part}", (*above, inner))


def test_every_new_field_is_left_out_of_what_is_stored_while_it_has_its_default() -> None:
    before, later = set(BEFORE.read_text().split()), tuple(f"spec.{path}" for path in LATER_FIELDS)
    new = {path for path in fields_of(ResolvedJob) if path not in before}
    assert {path for path in new if not path.startswith(later)} == set()
    assert set(later) <= new


def test_a_later_field_that_is_used_is_stored() -> None:
    spec = JobSpec.model_validate({"scene": "fish", "slots": 2})
    assert "slots" not in later_defaults(spec)
    stored = spec.model_dump(mode="json", exclude=later_defaults(spec))
    assert stored["slots"] == 2
    assert "engine" not in stored["render"]
    assert JobSpec.model_validate(stored) == spec
