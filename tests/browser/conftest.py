"""Broker, service, worker and Chromium; a page that may neither complain nor leave the state."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import pytest
from playwright._impl._driver import compute_driver_executable
from playwright.sync_api import Browser, Page, Playwright, Request, expect, sync_playwright

from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order
from service.schemas.access import Role
from service.settings import Settings
from tests.broker import Broker
from tests.browser.panel import PanelBridge
from tests.browser.studio import SPEC, Studio, parts
from tests.builders_messages import seals_in
from tests.integration.service.conftest import FakeWorker, Service
from tests.needs import missing, need_to_run
from tests.network_quiet import unchanged_network
from tests.prefix_proxy import PrefixProxy
from tests.waiting import ENOUGH_S, until

CHROMIUM_ARGS = [
    "--no-sandbox",  # tests run as root in containers; the page is ours
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--mute-audio",
    "--enable-unsafe-swiftshader",  # WebGL2 without a graphics card
]
PATIENCE_MS = 1000 * ENOUGH_S


@dataclass
class Farm:
    """A service, the worker that the test plays, and somebody's key."""

    service: Service
    studio: Studio
    key: str
    url: str
    """The address at which the browser finds the service."""

    def submit(self, **changes: Any) -> str:
        answer = self.service.client.post("/jobs", json=SPEC | changes)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    def submit_held(self) -> str:
        """Submit a job whose orders wait for `Studio.let`, and return its id once it is running."""
        self.studio.hold()
        job_id = self.submit()
        until(lambda: self.service.status(job_id) == "running")
        return job_id


@dataclass
class Watch:
    """What a page did that it should not."""

    origin: str
    complaints: list[str] = field(default_factory=list)
    strangers: list[str] = field(default_factory=list)

    def over(self, page: Page) -> None:
        page.on("console", lambda message: self.complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", self._look_at)

    def _look_at(self, request: Request) -> None:
        if not f"{request.url}/".startswith(self.origin + "/"):
            self.strangers.append(request.url)


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def proxy() -> PrefixProxy | None:
    """Return the reverse proxy in front of the service; only one module has one."""
    return None


@pytest.fixture
def panel() -> PanelBridge | None:
    """Return the bridge of a panel on this machine; only one module has one."""
    return None


@pytest.fixture
def body_limit_mb() -> float:
    """Return the largest size of a request; a test may ask for another one."""
    return 256.0


@pytest.fixture
def farm(
    tmp_path: Path, broker: Broker, proxy: PrefixProxy | None, panel: PanelBridge | None, body_limit_mb: float
) -> Iterator[Farm]:
    given = parts(tmp_path)
    settings = Settings(
        data_dir=tmp_path, redis_url=broker.url, reconcile_s=0.2, tick_s=0.05, retry_pause_s=0.0,
        public_url=proxy.url if proxy else "", panel_url=panel.url if panel else "",
        body_limit_mb=body_limit_mb,
    )  # fmt: skip
    service = Service(settings, given)
    if proxy:
        proxy.upstream = service.url
    studio = Studio(given.store)
    # What it answers is gone through one by one, so it may as well be said one by one.
    worker = FakeWorker(broker, seals_in(tmp_path), cast("Callable[[Order], list[Event]]", studio))
    yield Farm(service, studio, service.new_key(Role.SUBMITTER), proxy.url if proxy else service.url)
    studio.let(1000)
    worker.stop()
    if not service.server.should_exit:
        service.stop()


# Of the package, not of the session: while Playwright is open the thread has a running event loop, and tests elsewhere
# that call asyncio.run would fail.
@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    need_to_run([*compute_driver_executable(), "--version"], what="Playwright's driver does not start")
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="package")
def chromium(playwright: Playwright) -> Iterator[Browser]:
    program = os.environ.get("LIPPMANN_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        missing("Chromium is not installed")
    expect.set_options(timeout=PATIENCE_MS)
    browser = playwright.chromium.launch(executable_path=program, args=CHROMIUM_ARGS)
    yield browser
    browser.close()


@pytest.fixture(autouse=True)
def unchanged_interfaces() -> Iterator[None]:
    """Keep the interfaces of this machine as they are while a page asks the service."""
    with unchanged_network():
        yield


@pytest.fixture
def watch(farm: Farm) -> Watch:
    return Watch(farm.url)


@pytest.fixture
def page(chromium: Browser, farm: Farm, watch: Watch) -> Iterator[Page]:
    """Lend a page; afterwards it must have been silent, and have asked nobody but the service."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    watch.over(page)
    yield page
    context.close()
    assert watch.complaints == []
    assert watch.strangers == []


@pytest.fixture
def log_in(page: Page, farm: Farm) -> Callable[[], Page]:
    """Return how to get past the page that asks for a key."""

    def go(key: str = farm.key) -> Page:
        page.goto(farm.url)
        page.get_by_label("API key").fill(key)
        page.get_by_role("button", name="Log in").click()
        page.get_by_role("heading", name="Jobs").wait_for()
        return page

    return go
