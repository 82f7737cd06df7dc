"""Links to files of a job: what they give without a key, and when they end."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from lippmann.key_file import KeyFile, derived_key
from service.artifact_links import PURPOSE, ArtifactLinks
from service.auth import create_key
from service.errors import Unauthorized
from service.schemas.access import Role
from tests.builders_service import Client, Farm

DATA = bytes(range(256)) * 4
FILE, OTHER = "video/views.mp4", "video/centre.mp4"
DAY_S = 86_400


@pytest.fixture
def job_id(api_farm: Farm) -> str:
    job_id = api_farm.planned()
    for name in (FILE, OTHER):
        api_farm.store.files[f"{job_id}/{name}"] = DATA
    return job_id


def _link(api: Client, job_id: str, *, headers: dict[str, str] | None = None, **more: Any) -> str:
    body = {"artifact": FILE} | more
    answer = api.post(f"/api/v1/jobs/{job_id}/links", json=body, headers=headers)
    assert answer.status_code == 201, answer.text
    url = httpx.URL(answer.json()["url"])
    return str(url.raw_path, "ascii")


def _without_a_key(api: Client, url: str, **headers: str) -> Any:
    key = api.headers.pop("Authorization", None)
    try:
        return api.get(url, headers=headers)
    finally:
        if key is not None:
            api.headers["Authorization"] = key


def test_a_link_gives_one_file_without_a_key_whole_and_in_part(api: Client, job_id: str) -> None:
    url = _link(api, job_id)
    whole, part = _without_a_key(api, url), _without_a_key(api, url, Range="bytes=10-19")
    assert (whole.status_code, whole.content) == (200, DATA)
    assert (part.status_code, part.content, part.headers["Content-Range"]) == (206, DATA[10:20], "bytes 10-19/1024")
    assert _without_a_key(api, url, **{"If-None-Match": whole.headers["ETag"]}).status_code == 304
    assert _without_a_key(api, url, Range="bytes=1024-").status_code == 416


@pytest.mark.promise("People", "A link to a file gives this file only, to whoever has the link.")
@pytest.mark.parametrize(
    "change",
    [
        lambda url: url.partition("?")[0],
        lambda url: url.replace(FILE, OTHER),
        lambda url: url.replace("/links/", "/links/0"),
        lambda url: url[:-1] + ("0" if url[-1] != "0" else "1"),
        lambda url: url.replace("token=1", "token=2"),
        lambda url: url.replace("token=", "token=0"),
        lambda url: url + "0",
        lambda url: url.partition("token=")[0] + "token=" + "é" * 64,
        lambda url: url.partition("token=")[0] + "token=" + "9" * 5000,
    ],
)
def test_a_link_that_was_changed_is_refused(api: Client, job_id: str, change: Callable[[str], str]) -> None:
    answer = _without_a_key(api, change(_link(api, job_id)))
    assert (answer.status_code, answer.json()["code"]) == (401, "unauthorized")


@pytest.mark.promise("People", "A link to a file expires.")
def test_a_link_expires(api: Client, api_farm: Farm, job_id: str) -> None:
    url = _link(api, job_id, expires_in_s=60)
    api_farm.now_s += 59
    assert _without_a_key(api, url).status_code == 200
    api_farm.now_s += 1
    assert _without_a_key(api, url).status_code == 401


def test_the_farm_caps_how_long_a_link_is_valid(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", link_max_s=3600)
    api, job_id = make_client(farm), farm.planned()
    farm.store.files[f"{job_id}/{FILE}"] = DATA
    refused = api.post(f"/api/v1/jobs/{job_id}/links", json={"artifact": FILE, "expires_in_s": 3601})
    assert (refused.status_code, refused.json()["errors"]) == (
        422, [{"field": "expires_in_s", "expected": "at most 3600 s, the limit of the farm", "got": "3601"}],
    )  # fmt: skip
    made = api.post(f"/api/v1/jobs/{job_id}/links", json={"artifact": FILE}).json()
    assert datetime.fromisoformat(made["expires_at"]) == datetime.fromtimestamp(farm.now_s + 3600, UTC)


@pytest.mark.promise("People", "A link to a file ends when the job is removed.")
def test_a_link_ends_with_its_job(api: Client, job_id: str) -> None:
    url = _link(api, job_id)
    assert api.post(f"/api/v1/jobs/{job_id}/cancel").status_code == 200
    assert _without_a_key(api, url).status_code == 200
    assert api.delete(f"/api/v1/jobs/{job_id}").status_code == 204
    assert _without_a_key(api, url).status_code == 404


@pytest.mark.promise("People", "A link to a file ends with the key that made it.")
def test_a_link_ends_with_the_key_that_made_it(api: Client, job_id: str) -> None:
    made = api.post("/api/v1/keys", json={"name": "guest", "role": "viewer"}).json()
    url = _link(api, job_id, headers={"Authorization": f"Bearer {made['key']}"})
    assert _without_a_key(api, url).status_code == 200
    assert api.delete(f"/api/v1/keys/{made['id']}").status_code == 204
    assert _without_a_key(api, url).status_code == 401


def test_a_link_ends_with_the_key_of_the_farm_and_not_before(api: Client, api_farm: Farm, job_id: str) -> None:
    url = _link(api, job_id)
    file = api_farm.settings.link_keys.path
    old = file.read_text()
    _replace(file, "a" * 64 + "\n" + old)
    assert _without_a_key(api, url).status_code == 200
    _replace(file, "a" * 64 + "\n")
    assert _without_a_key(api, url).status_code == 401
    assert _without_a_key(api, _link(api, job_id)).status_code == 200


@pytest.mark.promise("People", "A link to a file gives no more than its maker may see.")
def test_a_link_gives_no_more_than_its_maker_may_see(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", sharing=False)
    api = make_client(farm)
    with farm.writing() as session:
        keys = {name: create_key(session, name, Role.VIEWER, owner_id=name)[1] for name in ("k", "bob")}
    job_id = farm.planned()  # of the owner k
    farm.store.files[f"{job_id}/{FILE}"] = DATA
    body = {"artifact": FILE}
    hidden = api.post(f"/api/v1/jobs/{job_id}/links", json=body, headers={"Authorization": f"Bearer {keys['bob']}"})
    assert hidden.status_code == 404
    farm.settings = farm.settings.model_copy(update={"sharing": True})
    shared = make_client(farm)
    url = _link(shared, job_id, headers={"Authorization": f"Bearer {keys['bob']}"})
    assert _without_a_key(shared, url).status_code == 200
    assert _without_a_key(api, url).status_code == 404
    assert _without_a_key(api, _link(api, job_id, headers={"Authorization": f"Bearer {keys['k']}"})).status_code == 200


@pytest.mark.parametrize("artifact", ["video/none.mp4", "../x", "a\nb", "x" * 201, ""])
def test_there_is_no_link_to_a_file_that_is_not_there(api: Client, job_id: str, artifact: str) -> None:
    answer = api.post(f"/api/v1/jobs/{job_id}/links", json={"artifact": artifact})
    assert answer.status_code == (404 if 0 < len(artifact) <= 200 else 422)


def test_a_link_is_written_to_the_audit_log_without_its_token(api: Client, api_farm: Farm, job_id: str) -> None:
    url = _link(api, job_id, expires_in_s=DAY_S)
    (entry, *_) = api.get("/api/v1/audit").json()["items"]
    until = datetime.fromtimestamp(api_farm.now_s + DAY_S, UTC)
    assert (entry["action"], entry["subject"], entry["detail"]) == (
        "link-artifact", job_id, f"{FILE} until {until:%Y-%m-%dT%H:%M:%SZ}",
    )  # fmt: skip
    assert url.rpartition(".")[2] not in str(entry)


def test_the_key_of_a_link_is_neither_that_of_the_farm_nor_that_of_another_purpose(tmp_path: Path) -> None:
    file = KeyFile(tmp_path / "link.key")
    file.ensure()
    (key,) = file.keys()
    assert len({key, derived_key(key, PURPOSE), derived_key(key, "webhook")}) == 3
    links = ArtifactLinks(lambda: [key])
    token = links.token("j", FILE, expires_s=100, key_id="k")
    assert links.maker(token, "j", FILE, now_s=99.0) == "k"
    with pytest.raises(Unauthorized):
        ArtifactLinks(lambda: [derived_key(key, PURPOSE)]).maker(token, "j", FILE, now_s=99.0)


def test_the_key_file_of_links_is_not_that_of_orders_and_for_its_user_only(api: Client, api_farm: Farm) -> None:
    assert api.get("/api/v1/health").status_code == 200
    assert api_farm.settings.link_keys.keys() != api_farm.settings.order_keys.keys()
    assert api_farm.settings.link_keys.path.stat().st_mode & 0o777 == 0o600


def _replace(file: Path, text: str) -> None:
    new = file.with_suffix(".new")
    new.touch(0o600)
    new.write_text(text)
    new.replace(file)
