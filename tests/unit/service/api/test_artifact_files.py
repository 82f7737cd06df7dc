"""Files of a job, whole and in part, and what a browser is told about them."""

from __future__ import annotations

from typing import Any, cast

import pytest
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st

from service.api.artifact_files import parse_range
from service.errors import RangeNotSatisfiable
from service.viewing.process_pool import ProcessPool
from tests.builders_service import Client, Farm, claimed, done, failed

DATA = bytes(range(256)) * 4


@pytest.fixture
def url(api: Client, api_farm: Farm) -> str:
    job_id = api_farm.planned()
    for name in ("integral/0001.exr", "integral/0002.exr", "video/views.mp4", "thumbs/0001.webp"):
        api_farm.store.files[f"{job_id}/{name}"] = DATA
    return f"/api/v1/jobs/{job_id}/artifacts"


def test_a_file_comes_whole_with_a_strong_etag(api: Client, url: str) -> None:
    answer = api.get(f"{url}/video/views.mp4")
    assert (answer.status_code, answer.content) == (200, DATA)
    assert answer.headers["ETag"].startswith('"')
    assert answer.headers["Content-Length"] == "1024"
    assert answer.headers["Content-Type"] == "video/mp4"
    assert answer.headers["Accept-Ranges"] == "bytes"
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_what_the_caller_has_is_not_sent_again(api: Client, url: str) -> None:
    etag = api.get(f"{url}/video/views.mp4").headers["ETag"]
    answer = api.get(f"{url}/video/views.mp4", headers={"If-None-Match": f'"other", {etag}'})
    assert (answer.status_code, answer.content, answer.headers["ETag"]) == (304, b"", etag)
    assert api.get(f"{url}/video/views.mp4", headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize(
    ("header", "start", "stop"),
    [("bytes=0-9", 0, 10), ("bytes=1000-", 1000, 1024), ("bytes=-24", 1000, 1024), ("bytes=1000-9999", 1000, 1024)],
)
def test_a_range_comes_as_asked(api: Client, url: str, header: str, start: int, stop: int) -> None:
    answer = api.get(f"{url}/video/views.mp4", headers={"Range": header})
    assert (answer.status_code, answer.content) == (206, DATA[start:stop])
    assert answer.headers["Content-Range"] == f"bytes {start}-{stop - 1}/1024"
    assert answer.headers["Content-Length"] == str(stop - start)


def test_a_range_outside_of_the_file_is_a_problem_that_says_its_size(api: Client, url: str) -> None:
    answer = api.get(f"{url}/video/views.mp4", headers={"Range": "bytes=1024-"})
    assert (answer.status_code, answer.json()["code"]) == (416, "range-not-satisfiable")
    assert answer.headers["Content-Range"] == "bytes */1024"


def test_a_range_of_what_has_changed_is_the_whole(api: Client, url: str) -> None:
    etag = api.get(f"{url}/video/views.mp4").headers["ETag"]
    headers = {"Range": "bytes=0-9", "If-Range": etag}
    assert api.get(f"{url}/video/views.mp4", headers=headers).status_code == 206
    assert api.get(f"{url}/video/views.mp4", headers=headers | {"If-Range": '"old"'}).status_code == 200


def test_head_says_what_get_would_without_the_file(api: Client, url: str) -> None:
    get, head = api.get(f"{url}/video/views.mp4"), api.head(f"{url}/video/views.mp4")
    assert (head.status_code, head.content) == (200, b"")
    for name in ("ETag", "Content-Length", "Content-Type", "Content-Disposition"):
        assert head.headers[name] == get.headers[name]


@given(size=st.integers(1, 50), first=st.none() | st.integers(0, 60), last=st.none() | st.integers(0, 60))
def test_every_range_lies_within_the_file_and_begins_and_ends_where_it_was_asked_to(
    size: int, first: int | None, last: int | None
) -> None:
    header = f"bytes={'' if first is None else first}-{'' if last is None else last}"
    try:
        found = parse_range(header, size)
    except RangeNotSatisfiable:
        assert (first is not None and first >= size) or (first is None and last == 0)
        return
    if found is None:
        assert (first is None and last is None) or (first is not None and last is not None and last < first)
        return
    start, stop = found
    assert 0 <= start < stop <= size
    assert start == (first if first is not None else max(0, size - (last or 0)))
    assert stop == (min(last + 1, size) if first is not None and last is not None else size)


def test_an_exr_becomes_a_png_on_the_way(api: Client, url: str) -> None:
    answer = api.get(f"{url}/integral/0001.exr", params={"format": "png", "bits": 16})
    assert (answer.content, answer.headers["Content-Type"]) == (b"png of 0001.exr, 16 bits", "image/png")
    assert answer.headers["Content-Disposition"].endswith('integral-0001.png"')
    etag = answer.headers["ETag"]
    again = api.get(f"{url}/integral/0001.exr", params={"format": "png", "bits": 16}, headers={"If-None-Match": etag})
    assert again.status_code == 304
    other = api.get(f"{url}/integral/0001.exr", params={"format": "png"}, headers={"If-None-Match": etag})
    assert other.content == b"png of 0001.exr, 8 bits"


def test_head_of_a_picture_converts_nothing_and_says_no_length(
    api: Client, api_farm: Farm, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    get = api.get(f"{url}/integral/0001.exr", params={"format": "png"})
    monkeypatch.setattr(ProcessPool, "make", None)
    head = api.head(f"{url}/integral/0001.exr", params={"format": "png"})
    assert (head.status_code, head.content) == (200, b"")
    assert "Content-Length" not in head.headers
    for name in ("ETag", "Content-Type", "Content-Disposition"):
        assert head.headers[name] == get.headers[name]


@pytest.mark.parametrize(
    ("path", "field"), [("video/views.mp4?format=png", "format"), ("integral/0001.exr?format=png&bits=9", "bits")]
)
def test_what_cannot_be_converted_is_a_problem(api: Client, url: str, path: str, field: str) -> None:
    answer = api.get(f"{url}/{path}")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, field)


@pytest.mark.parametrize(
    "name",
    [
        "nothing.exr",
        "../../lippmann.db",
        "..%2f..%2flippmann.db",
        "%2e%2e/x",
        "a//b",
        "a/./b",
        "a%00b",
        "a\\b",
        ".hidden",
        "x" * 300,
    ],
)
def test_what_is_not_there_or_not_below_the_job_is_not_found(api: Client, url: str, name: str) -> None:
    answer = api.get(f"{url}/{name}")
    assert answer.status_code == 404
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_files_are_listed_in_pages_below_a_prefix(api: Client, url: str) -> None:
    page = api.get(url, params={"prefix": "integral/", "limit": 1}).json()
    assert [item["name"] for item in page["items"]] == ["integral/0001.exr"]
    assert page["items"][0]["url"] == f"{url}/integral/0001.exr"
    assert api.get(page["items"][0]["url"]).headers["ETag"] == f'"{page["items"][0]["etag"]}"'
    page = api.get(url, params={"prefix": "integral/", "limit": 1, "cursor": page["next_cursor"]}).json()
    assert ([item["name"] for item in page["items"]], page["next_cursor"]) == (["integral/0002.exr"], None)


def test_a_page_of_files_asks_the_store_for_no_more_than_it_shows(
    api: Client, api_farm: Farm, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    state = cast(FastAPI, api.app).state.lippmann
    whole = api_farm.store.list

    def listing(prefix: str, *, after: str = "", limit: int | None = None) -> Any:
        asked.append((limit, state.database._engine.pool.checkedout()))
        return whole(prefix, after=after, limit=limit)

    monkeypatch.setattr(api_farm.store, "list", listing)
    api.get(url, params={"limit": 2})
    assert asked == [(3, 0)]


def test_a_job_sees_no_other_jobs_files(api: Client, api_farm: Farm, url: str) -> None:
    api_farm.store.files["other/secret.txt"] = b"x"
    names = [item["name"] for item in api.get(url, params={"limit": 500}).json()["items"]]
    assert "integral/0001.exr" in names
    assert not [name for name in names if "secret" in name]


def test_frames_carry_the_places_of_their_pictures_once_they_are_done(api: Client, api_farm: Farm, url: str) -> None:
    job_url = url.removesuffix("/artifacts")
    for order in api_farm.dispatch()[:2]:
        api_farm.say(done(order))
    assert [frame["status"] for frame in api.get(f"{job_url}/frames").json()["items"]] == [
        "rendering", "waiting", "waiting",
    ]  # fmt: skip
    api_farm.work()
    page = api.get(f"{job_url}/frames", params={"limit": 2}).json()
    assert page["items"][0] == {
        "frame": 1, "status": "done", "thumb": f"{url}/thumbs/0001.webp", "integral": f"{url}/integral/0001.exr",
        "orthoscopic": f"{url}/orthoscopic/0001.exr", "views": f"{url}/views/0001.exr",
    }  # fmt: skip
    assert page["next_cursor"] == "2"


def test_in_a_job_that_has_ended_nothing_is_being_rendered(api: Client, api_farm: Farm, url: str) -> None:
    job_url = url.removesuffix("/artifacts")
    first, second, other, _ = api_farm.dispatch()
    api_farm.say(done(first), done(second))
    api_farm.say(claimed(other))

    def statuses() -> list[str]:
        return [frame["status"] for frame in api.get(f"{job_url}/frames").json()["items"]]

    assert statuses() == ["rendering", "rendering", "waiting"]
    api_farm.say(failed(other, permanent=True))
    assert api.get(job_url).json()["status"] == "failed"
    assert statuses() == ["waiting", "failed", "waiting"]


def test_the_latest_log_is_shown_and_any_other_on_demand(api: Client, api_farm: Farm, url: str) -> None:
    job_url = url.removesuffix("/artifacts")
    job_id = job_url.rpartition("/")[2]
    order, *_ = api_farm.dispatch()
    log_url = f"{job_url}/tasks/{order.task_id}/log"
    assert api.get(log_url).status_code == 404
    api_farm.store.files[f"{job_id}/log/render-0001-00-00/1.txt"] = b"first"
    assert (api.get(log_url).text, api.get(log_url).headers["Content-Type"]) == ("first", "text/plain; charset=utf-8")
    assert api.get(log_url, params={"attempt": 1}).text == "first"
    assert api.get(log_url, params={"attempt": 2}).status_code == 404
