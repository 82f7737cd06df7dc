"""All files of an output in one zip: whole, or visibly not."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable

import pytest

from lippmann.digest import digest_of
from lippmann.job.messages.orders import TaskKind
from service.api import output_archive
from service.errors import ArtifactRepairing
from service.jobs import artifact_guard
from tests.builders_service import Client, Farm, claimed, done

FILES = {
    "exports/view_grid/0001.png": b"one" * 1000,
    "exports/view_grid/0002.png": bytes(range(256)) * 100,
    "exports/view_grid/0003.png": b"three",
    "exports/view_grid.png.json": b"{}",
}
DAMAGED = FILES["exports/view_grid/0002.png"][:-1] + b"?"


@pytest.fixture
def job_id(api_farm: Farm) -> str:
    """A job with an output of several files and one that is not made yet."""
    return made(api_farm)


def made(farm: Farm, *, digests: bool = True) -> str:
    job_id = farm.planned(outputs=["view_grid.png", "views.mp4"])
    for _ in range(9):
        for order in farm.dispatch():
            known = {}
            if order.output == "view_grid.png":
                farm.store.files |= {f"{order.job_id}/{name}": data for name, data in FILES.items()}
                known = {name: digest_of([data]) for name, data in FILES.items()} if digests else {}
            if order.output != "views.mp4":
                farm.say(claimed(order), done(order, digests=known))
        farm.plan()
    assert {order.output for order in farm.queue.orders if order.kind is TaskKind.ENCODE} == {
        "view_grid.png",
        "views.mp4",
    }
    return job_id


def url(job_id: str, output: str = "view_grid.png") -> str:
    return f"/api/v1/jobs/{job_id}/outputs/{output}.zip"


def unpacked(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_files_of_an_output_come_in_one_zip_whose_size_is_known(api: Client, job_id: str) -> None:
    answer = api.get(url(job_id))
    assert (answer.status_code, answer.headers["Content-Type"]) == (200, "application/zip")
    assert int(answer.headers["Content-Length"]) == len(answer.content)
    assert answer.headers["Content-Disposition"] == f'attachment; filename="{job_id}-view_grid.png.zip"'
    assert unpacked(answer.content) == {name.removeprefix("exports/"): data for name, data in FILES.items()}
    (grid, video) = api.get(f"/api/v1/jobs/{job_id}").json()["outputs"]
    assert (grid["archive_url"], grid["ready"], video["ready"]) == (url(job_id), True, False)


def test_nothing_is_read_before_it_is_sent(api_farm: Farm, job_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    really = api_farm.store.read_range

    def reading(name: str, start: int, stop: int):  # type: ignore[no-untyped-def]
        opened.append(name.partition("/")[2])
        return really(name, start, stop)

    monkeypatch.setattr(api_farm.store, "read_range", reading)
    guard = artifact_guard.ArtifactGuard(api_farm.database, api_farm.store)
    archive = output_archive.find_archive(api_farm.database, api_farm.store, guard, job_id, "view_grid.png")
    assert opened == []
    next(archive.chunks)  # the header of the first file
    next(archive.chunks)
    assert opened == ["exports/view_grid.png.json"]
    guard.close()


@pytest.mark.parametrize("output", ["view_gird.png", "views.webm", "views.mp4", "view_grid", "..", "%2e%2e"])
def test_an_output_that_does_not_exist_or_is_not_made_yet_is_not_found(api: Client, job_id: str, output: str) -> None:
    answer = api.get(url(job_id, output))
    assert (answer.status_code, answer.json()["code"]) == (404, "not-found")


def test_a_missing_file_is_found_before_the_answer_begins_and_made_again(
    api: Client, api_farm: Farm, job_id: str
) -> None:
    del api_farm.store.files[f"{job_id}/exports/view_grid/0002.png"]
    answer = api.get(url(job_id))
    assert (answer.status_code, answer.json()["code"]) == (503, "artifact-repairing")
    assert answer.headers["Retry-After"]


def test_a_file_that_is_too_short_is_found_before_the_answer_begins(api: Client, api_farm: Farm, job_id: str) -> None:
    api_farm.store.files[f"{job_id}/exports/view_grid/0002.png"] = b"short"
    assert api.get(url(job_id)).status_code == 503


def test_a_damaged_file_never_gives_a_zip_of_the_whole_size(api: Client, api_farm: Farm, job_id: str) -> None:
    whole = api.get(url(job_id)).content
    api_farm.store.files[f"{job_id}/exports/view_grid/0002.png"] = DAMAGED
    guard = artifact_guard.ArtifactGuard(api_farm.database, api_farm.store)
    archive = output_archive.find_archive(api_farm.database, api_farm.store, guard, job_id, "view_grid.png")
    received: list[bytes] = []
    with pytest.raises(ArtifactRepairing, match=r"0002\.png is damaged"):
        received.extend(archive.chunks)
    data = b"".join(received)
    assert archive.size == len(whole) > len(data) > 3000
    with pytest.raises(zipfile.BadZipFile):
        zipfile.ZipFile(io.BytesIO(data))
    assert api.get(url(job_id)).status_code == 404  # The output is made again.
    guard.close()


def test_an_output_without_digests_is_the_files_that_its_sidecar_lists(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0")
    job_id = made(farm, digests=False)
    sidecar = f"{job_id}/exports/view_grid.png.json"
    farm.store.files[sidecar] = json.dumps({"files": [name for name in FILES if name.endswith(".png")]}).encode()
    archive = unpacked(make_client(farm).get(url(job_id)).content)
    assert set(archive) == {name.removeprefix("exports/") for name in FILES}


def test_a_zip_may_be_larger_than_4_gb(api_farm: Farm, job_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    size = 2**32 + 2**24
    chunk = bytes(2**24)
    monkeypatch.setattr(output_archive, "_expected", lambda *_: (_output(api_farm, job_id), {"exports/big": None}))
    monkeypatch.setattr(api_farm.store, "size", lambda _: size)
    monkeypatch.setattr(api_farm.store, "etag", lambda _: "e")
    api_farm.store.files[f"{job_id}/exports/big"] = b""
    monkeypatch.setattr(api_farm.store, "read_range", lambda *_: iter([chunk] * (size // len(chunk))))
    guard = artifact_guard.ArtifactGuard(api_farm.database, api_farm.store)
    archive = output_archive.find_archive(api_farm.database, api_farm.store, guard, job_id, "view_grid.png")
    sent, tail = 0, b""
    for data in archive.chunks:
        sent += len(data)
        tail = (tail + data[-200:])[-200:]
    assert sent == archive.size > size
    assert b"PK\x06\x06" in tail  # the ZIP64 end of central directory record
    guard.close()


def _output(farm: Farm, job_id: str):  # type: ignore[no-untyped-def]
    return farm.job(job_id).parsed_spec.outputs[0]
