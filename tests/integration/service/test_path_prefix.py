"""The service under a path of a host that has other sites, behind a reverse proxy."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from http.cookiejar import Cookie
from pathlib import Path, PurePosixPath
from urllib.parse import urljoin

import httpx
import pytest

from lippmann.client import Client
from service.schemas.access import Role
from tests.builders_service import SPEC
from tests.integration.service.conftest import FakeWorker, Service
from tests.prefix_proxy import PrefixProxy, prefix_proxy
from tests.waiting import ENOUGH_S, until

PREFIX = "/lab/lippmann"
LOADED = re.compile(r'(?:src|href|action|data-logo)="([^"#]+)"')


@pytest.fixture(params=[True, False], ids=["removed", "kept"])
def proxy(request: pytest.FixtureRequest) -> Iterator[PrefixProxy]:
    with prefix_proxy(PREFIX, removes=request.param) as proxy:
        yield proxy


@pytest.fixture
def prefixed(proxy: PrefixProxy, make_service: Callable[..., Service]) -> Service:
    """Lend a service behind the proxy."""
    service = make_service(public_url=proxy.url, trusted_proxies="127.0.0.1")
    proxy.upstream = service.url
    return service


@pytest.fixture
def browser(proxy: PrefixProxy, prefixed: Service) -> Iterator[httpx.Client]:
    """Lend a client that keeps cookies as a browser does."""
    with httpx.Client(base_url=proxy.origin, timeout=ENOUGH_S) as client:
        yield client


def cookie(browser: httpx.Client) -> Cookie:
    (found,) = browser.cookies.jar
    return found


def test_a_browser_logs_in_sees_the_page_and_logs_out(browser: httpx.Client, prefixed: Service) -> None:
    link = prefixed.client.post("/login-tokens").json()["url"]
    assert link.startswith(f"{browser.base_url}{PREFIX}/login?token=")
    opened = browser.get(link)
    assert (opened.status_code, opened.headers["Location"]) == (303, f"{PREFIX}/")
    assert cookie(browser).path == PREFIX
    page = browser.get(opened.headers["Location"]).text
    imports = json.loads(re.findall(r'type="importmap">(.*?)</script>', page)[0])["imports"]
    loaded = {*LOADED.findall(page), *imports.values()}
    assert {PurePosixPath(path.partition("?")[0]).name for path in loaded} >= {"page.js", "page.css", "preact.js"}
    assert {path: browser.get(path).status_code for path in loaded if browser.get(path).status_code != 200} == {}
    assert all(name.startswith(PREFIX) for name in imports if name.startswith("/"))
    assert f'data-root="{PREFIX}"' in page
    left = browser.post(f"{PREFIX}/logout", headers={"X-Lippmann-Request": "1"})
    assert (left.status_code, left.headers["Location"]) == (303, f"{PREFIX}/")
    assert list(browser.cookies.jar) == []
    form = browser.get(f"{PREFIX}/").text
    assert f'action="{PREFIX}/login"' in form
    refused = browser.post(f"{PREFIX}/login", data={"key": "lip_x_y"}, headers={"Accept": "text/html"})
    assert refused.headers["Location"] == f"{PREFIX}/?refused=1"


def test_the_python_client_takes_an_address_with_a_path(
    proxy: PrefixProxy, prefixed: Service, make_worker: Callable[..., FakeWorker], tmp_path: Path
) -> None:
    make_worker()
    with Client(proxy.url + "/", prefixed.new_key(Role.ADMIN), patience_s=ENOUGH_S) as client:
        until(lambda: client.health().workers == 1)
        job = client.submit(SPEC)
        *_, ended = client.follow(job.id)
        assert ended.status == "done"
        names = [artifact.name for artifact in client.artifacts(job.id)]
        assert "job.json" in names
        file = client.download(job.id, "job.json", tmp_path / "job.json")
        assert json.loads(file.path.read_text())["spec"]["scene"] == SPEC["scene"]
        assert client.upload_scene("mine", b"PK" + b"\0" * 3_000_000).name == "mine"


def test_urls_that_the_api_answers_lead_through_the_proxy(browser: httpx.Client, prefixed: Service) -> None:
    browser.headers["Authorization"] = f"Bearer {prefixed.new_key(Role.ADMIN)}"
    served = browser.get(f"{PREFIX}/api/v1/openapi.json").json()
    assert served["servers"] == [{"url": PREFIX}]
    made = browser.post(f"{PREFIX}/api/v1/jobs", json=SPEC)
    assert browser.get(urljoin(str(made.url), made.headers["Location"])).json()["id"] == made.json()["id"]
    redirected = browser.get(f"{PREFIX}/api/v1/jobs/")
    assert redirected.status_code == 307
    assert browser.get(redirected.headers["Location"]).json()["items"][0]["id"] == made.json()["id"]
    # What an answer calls a URL is, like the paths of the description, below the server.
    (output,) = made.json()["outputs"]
    assert output["url"].startswith("/api/v1/jobs/")
    assert browser.get(PREFIX + output["url"]).json()["code"] == "artifact-missing"
    with browser.stream("GET", f"{PREFIX}/api/v1/events?job={made.json()['id']}") as stream:
        assert next(line for line in stream.iter_lines() if line.startswith("event")) == "event: job"


def test_who_reaches_the_service_without_the_proxy_needs_no_prefix(prefixed: Service) -> None:
    assert prefixed.client.get("/session").status_code == 200
    assert httpx.get(f"{prefixed.url}{PREFIX}elsewhere/api/v1/health").status_code == 404
