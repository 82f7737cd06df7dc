"""The parameters in the query of a request: a route takes those that it has, each once.

A parameter that nobody reads would be dropped without a note: `?stauts=failed` would list the jobs of all statuses.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin

from fastapi import Request
from fastapi.dependencies.models import Dependant
from pydantic import BaseModel

from lippmann.errors import FieldProblem, first_problems
from service.errors import Invalid
from service.schemas.links import API


async def check_query(request: Request) -> None:
    """Refuse parameters that the route of a request does not have, or that it takes once and got more often.

    Pages outside of the API take any: links to them come from mails and from providers of logins.

    Raises
    ------
    Invalid
        The error names every such parameter.
    """
    if not request.query_params or not request.url.path.startswith(f"{request.scope.get('root_path', '')}{API}/"):
        return
    known = _parameters(request.scope["route"].dependant)
    counts = Counter(name for name, _ in request.query_params.multi_items())
    problems = first_problems(
        _problem(name, count, known) for name, count in counts.items() if count > known.get(name, 0)
    )
    if problems:
        raise Invalid("; ".join(map(str, problems)), problems=problems)


def _problem(name: str, count: int, known: Mapping[str, float]) -> FieldProblem:
    if name in known:
        return FieldProblem(field=name, expected="one value", got=f"{count} values")
    names = ", ".join(sorted(known))
    expected = f"one of the parameters {names}" if names else "no parameters"
    return FieldProblem(field=name[:80], expected=expected, got="an unknown parameter")


def _parameters(dependant: Dependant) -> Mapping[str, float]:
    """Return how often a route takes each parameter of its query."""
    most: dict[str, float] = {}
    for alias, kind in _declared(dependant):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            most |= {given.alias or name: 1 for name, given in kind.model_fields.items()}
        else:
            most[alias] = math.inf if _is_list(kind) else 1
    return most


def _declared(dependant: Dependant) -> Iterator[tuple[str, Any]]:
    for field in dependant.query_params:
        yield field.alias, field.field_info.annotation
    for one in dependant.dependencies:
        yield from _declared(one)


def _is_list(kind: Any) -> bool:
    return get_origin(kind) is list or any(get_origin(one) is list for one in get_args(kind))
