"""Parameters in the query of a request that its route does not have, or takes once."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.builders_service import Client, Farm

OF_JOBS = "ascending, count, cursor, limit, offset, owner, search, sort, status"


@pytest.fixture
def api(make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]) -> Client:
    return make_client(make_farm(coordinator=False))


@pytest.mark.parametrize(
    ("query", "problem"),
    [
        ("jobs?stauts=failed", {"field": "stauts", "expected": f"one of the parameters {OF_JOBS}"}),
        ("jobs?limit=2&limit=3", {"field": "limit", "expected": "one value", "got": "2 values"}),
        ("jobs?cursor=", None),
        ("keys?limt=2", {"field": "limt", "got": "an unknown parameter"}),
        ("waiting?tag=a&tag=b&pool=", None),
        ("waiting?tags=a", {"field": "tags", "expected": "one of the parameters engine, memory_mb, pool, tag"}),
    ],
)
def test_a_route_takes_its_parameters_each_once(api: Client, query: str, problem: dict[str, str] | None) -> None:
    answer = api.get(f"/api/v1/{query}")
    if problem is None:
        assert answer.status_code == 200
    else:
        assert answer.status_code == 422
        assert problem.items() <= answer.json()["errors"][0].items()


def test_a_parameter_in_a_model_of_the_query_is_known(api: Client) -> None:
    path = "/api/v1/jobs/none/frames/1/view"
    known, unknown = api.get(f"{path}?u=0&v=0"), api.get(f"{path}?u=0&v=0&w=1")
    assert known.status_code == 404
    assert unknown.status_code == 422
    assert unknown.json()["errors"][0]["field"] == "w"


def test_without_a_key_nobody_learns_the_parameters_of_a_route(api: Client) -> None:
    answer = api.get("/api/v1/jobs?stauts=failed", headers={"Authorization": ""})
    assert answer.status_code == 401
    assert "stauts" not in answer.text


def test_a_page_takes_any_parameter(api: Client) -> None:
    assert api.get("/?utm_source=mail").status_code == 200
