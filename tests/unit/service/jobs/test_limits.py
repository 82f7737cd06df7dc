"""The limits of the farm and of a key."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.spec import JobSpec
from service.auth import create_key
from service.jobs.limits import limited_spec, task_count
from service.limits import Limits
from service.schemas.access import KeyLimits, Role
from service.settings import Settings
from tests.builders_service import SPEC, Client, Farm

API = "/api/v1"
AWAY: dict[str, Any] = {"coordinator": False, "redis_url": "redis://127.0.0.1:1/0"}


def _spec(**changes: Any) -> JobSpec:
    return JobSpec.model_validate({"scene": "fish"} | changes)


def _limits(key: KeyLimits | None = None, **settings: Any) -> Limits:
    return Limits(Settings(**settings), key or KeyLimits())


def test_a_tebibyte_and_28_days_are_refused_with_field_limit_and_value() -> None:
    week_s = 7 * 86_400
    greedy = {"memory_mb": 2**20} | dict.fromkeys(
        ("timeout_s", "parse_timeout_s", "photons_timeout_s", "probe_timeout_s"), week_s
    )
    with pytest.raises(SpecError) as refused:
        limited_spec(_spec(render=greedy), _limits())
    assert {problem.field: (problem.expected, problem.got) for problem in refused.value.problems} == {
        "render.memory_mb": ("at most 65536 (LIPPMANN_MAX_MEMORY_MB of the farm)", "1048576"),
        **{
            f"render.{field}": ("at most 86400 (LIPPMANN_MAX_TIMEOUT_S of the farm)", "604800")
            for field in greedy
            if field != "memory_mb"
        },
    }


def test_the_defaults_of_the_format_are_within_the_limits_of_a_farm() -> None:
    assert limited_spec(_spec(), _limits()) == (_spec(), ())


def test_a_default_that_nobody_asked_for_is_lowered_with_a_note() -> None:
    spec, notes = limited_spec(_spec(), _limits(max_memory_mb=4096, max_timeout_s=1000))
    assert (spec.render.memory_mb, spec.render.timeout_s, spec.render.parse_timeout_s) == (4096, 1000, 900)
    assert notes == (
        "render.memory_mb is 4096 and not the default 8192, because that is the limit.",
        "render.timeout_s is 1000 and not the default 21600, because that is the limit.",
        "render.photons_timeout_s is 1000 and not the default 1800, because that is the limit.",
        "render.probe_timeout_s is 1000 and not the default 1800, because that is the limit.",
    )


@pytest.mark.parametrize(
    ("changes", "limits", "field", "got"),
    [
        ({"frames": "1-11"}, {"max_frames": 10}, "frames", "11"),
        (
            {"rig": {"lens_array": {"count": [10, 10]}, "px_per_lens": 10}, "capture": {"supersample": 2}},
            {"max_frame_px": 39_999},
            "rig.lens_array.count x rig.px_per_lens x capture.supersample",
            "40000",
        ),
        (
            {"rig": {"lens_array": {"count": [10, 10]}, "px_per_lens": 10}, "render": {"samples": 4}},
            {"max_frame_px": 39_999},
            "rig.lens_array.count x rig.px_per_lens x capture.supersample x render.samples",
            "40000",
        ),
        (
            {"rig": {"lens_array": {"count": [10, 10]}, "px_per_lens": 10}, "frames": "1-3"},
            {"max_job_px": 29_999},
            "frames x pixels of a frame",
            "30000",
        ),
        ({"frames": "1-3", "render": {"tiles": [2, 2]}}, {"max_tasks": 18}, "frames x render.tiles", "19"),
    ],
)
def test_a_job_at_its_limit_is_taken_and_one_beyond_it_is_refused(
    changes: dict[str, Any], limits: dict[str, Any], field: str, got: str
) -> None:
    ((name, most),) = limits.items()
    assert limited_spec(_spec(**changes), _limits(**{name: most + 1}))[1] == ()
    with pytest.raises(SpecError) as refused:
        limited_spec(_spec(**changes), _limits(**limits))
    (problem,) = refused.value.problems
    assert (problem.field, problem.got) == (field, got)


def test_the_lower_limit_of_farm_and_key_counts_and_is_named() -> None:
    of_key = _limits(KeyLimits(frames=5, memory_mb=100_000))
    assert str(of_key["frames"]) == "at most 5 (the limit frames of the key)"
    assert str(of_key["memory_mb"]) == "at most 65536 (LIPPMANN_MAX_MEMORY_MB of the farm)"


def test_the_tasks_are_counted_as_they_are_planned(farm: Farm) -> None:
    job_id = farm.planned(frames="1-4", render={"tiles": [2, 3]})
    assert task_count(farm.job(job_id).parsed_spec, tile_rows=2, tile_cols=3) == len(farm.tasks(job_id))


def test_automatic_tiles_that_would_be_too_many_tasks_become_whole_frames(make_farm: Callable[..., Farm]) -> None:
    changes = {"render": {}, "rig": {"lens_array": {"count": [100, 100]}, "px_per_lens": 20}}

    def tiles(farm: Farm) -> int:
        job_id = farm.planned(**changes)
        return sum(task.frame == 1 and task.tile is not None for task in farm.tasks(job_id))

    assert tiles(make_farm()) > 1
    assert tiles(make_farm(max_tasks=8)) == 1


def _key(farm: Farm, owner_id: str, **limits: int) -> dict[str, str]:
    with farm.writing() as session:
        key = create_key(session, "a key", Role.SUBMITTER, owner_id=owner_id, limits=KeyLimits(**limits))[1]
    return {"Authorization": f"Bearer {key}"}


def test_an_owner_with_as_many_open_jobs_as_allowed_is_told_when_to_come_back(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(**AWAY, max_open_jobs=2)
    api = make_client(farm)
    ann, bob = _key(farm, "ann"), _key(farm, "bob")
    jobs = [api.post(f"{API}/jobs", json=SPEC, headers=ann).json()["id"] for _ in range(2)]
    files = len(farm.store.files)
    refused = api.post(f"{API}/jobs", json=SPEC, headers=ann)
    assert (refused.status_code, refused.json()["code"], refused.headers["Retry-After"]) == (429, "quota", "60")
    assert refused.json()["detail"] == (
        "'ann' would have 3 open jobs, expected at most 2 (LIPPMANN_MAX_OPEN_JOBS of the farm); "
        "wait until jobs end, or cancel some"
    )
    assert len(farm.store.files) == files
    assert api.post(f"{API}/jobs", json=SPEC, headers=bob).status_code == 201
    api.post(f"{API}/jobs/{jobs[0]}/cancel", headers=ann)
    assert api.post(f"{API}/jobs", json=SPEC, headers=ann).status_code == 201
    assert api.post(f"{API}/jobs/{jobs[0]}/retry", headers=ann).status_code == 429
    assert farm.job(jobs[0]).status == "cancelled"


def test_a_key_has_a_quota_of_frames_which_its_browser_sessions_share(api: Client, api_farm: Farm) -> None:
    limits = {"open_frames": 5}
    made = api.post(f"{API}/keys", json={"name": "class", "owner_id": "ann", "limits": limits}).json()
    assert made["limits"]["open_frames"] == 5
    as_key = {"Authorization": f"Bearer {made['key']}"}
    assert api.post(f"{API}/jobs", json=SPEC, headers=as_key).status_code == 201  # of 3 frames
    assert api.post(f"{API}/jobs", json=SPEC, headers=as_key).status_code == 429
    del api.headers["Authorization"]
    api.post("/login", data={"key": made["key"]})
    assert api.post(f"{API}/jobs", json=SPEC, headers={"X-Lippmann-Request": "1"}).status_code == 429


def test_an_owner_has_a_largest_number_of_scenes(api: Client, api_farm: Farm) -> None:
    ann = _key(api_farm, "ann", scenes=1)

    def upload(name: str, data: bytes) -> int:
        files = {"bundle": ("b.zip", data, "application/zip")}
        return int(api.post(f"{API}/scenes", params={"name": name}, files=files, headers=ann).status_code)

    assert [upload("one", b"PK 1"), upload("two", b"PK 2"), upload("one", b"PK 3")] == [201, 403, 201]


@pytest.mark.promise("People", "The scene bundles of an owner are limited, replaced ones included.")
def test_the_bundles_of_an_owner_are_counted_replaced_ones_too_and_each_once(api: Client, api_farm: Farm) -> None:
    ann = _key(api_farm, "ann", bundles=2)

    def upload(name: str, data: bytes) -> Any:
        files = {"bundle": ("b.zip", data, "application/zip")}
        return api.post(f"{API}/scenes", params={"name": name}, files=files, headers=ann)

    assert [upload(*each).status_code for each in (("one", b"PK 1"), ("one", b"PK 2"))] == [201, 201]
    files = len(api_farm.store.files)
    refused = upload("one", b"PK 3")
    assert (refused.status_code, refused.json()["code"]) == (403, "storage-quota")
    assert "Retry-After" not in refused.headers
    assert refused.json()["detail"] == (
        "'ann' would have 3 scene bundles, expected at most 2 (the limit bundles of the key); "
        "bundles that were replaced count while jobs need them; remove jobs"
    )
    assert refused.json()["errors"] == [
        {"field": "bundles", "expected": "at most 2 (the limit bundles of the key)", "got": "3"}
    ]
    assert len(api_farm.store.files) == files
    assert upload("two", b"PK 1").status_code == 201, "a bundle that is stored takes no more room"


def test_the_bytes_of_the_bundles_of_an_owner_have_a_limit(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(**AWAY, max_bundles_mb=2)
    api, ann = make_client(farm), _key(farm, "ann")

    def upload(name: str, size: int) -> Any:
        files = {"bundle": ("b.zip", b"PK" + name.encode() + bytes(size - 3), "application/zip")}
        return api.post(f"{API}/scenes", params={"name": name}, files=files, headers=ann)

    assert [upload("a", 1_500_000).status_code, upload("b", 500_000).status_code] == [201, 201]
    refused = upload("c", 100_000)
    assert (refused.status_code, refused.json()["errors"]) == (
        403,
        [{"field": "bundles_mb", "expected": "at most 2 (LIPPMANN_MAX_BUNDLES_MB of the farm)", "got": "2.1"}],
    )


def test_a_repeated_submission_is_answered_although_the_quota_is_used_up(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    api = make_client(make_farm(**AWAY, max_open_jobs=1))
    answers = [api.post(f"{API}/jobs", json=SPEC, headers={"Idempotency-Key": "one"}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [201, 200]


def test_everybody_sees_what_the_owner_uses_and_who_limits_it(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(**AWAY, max_frames=9)
    api, ann, bob = make_client(farm), _key(farm, "ann", open_jobs=4), _key(farm, "bob")
    assert api.post(f"{API}/jobs", json=SPEC, headers=ann).status_code == 201

    def usage(key: dict[str, str]) -> dict[str, tuple[float | None, float, str]]:
        answer = api.get(f"{API}/usage", headers=key).json()
        return {item["name"]: (item["used"], item["limit"], item["source"]) for item in answer["items"]}

    assert api.get(f"{API}/usage", headers=ann).json()["owner_id"] == "ann"
    assert usage(ann).keys() == KeyLimits.model_fields.keys()
    assert usage(ann)["open_jobs"] == (1, 4, "the limit open_jobs of the key")
    assert usage(ann)["frames"] == (None, 9, "LIPPMANN_MAX_FRAMES of the farm")
    assert usage(ann)["open_frames"][0] == 3
    assert [used for used, _, _ in usage(bob).values() if used] == [], "nothing of others"
