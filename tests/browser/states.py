"""The pages of the dashboard in each of their states: `test_states` examines them and takes their pictures.

A state is a function that brings a page there, on a farm that the states before it may have used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from playwright.sync_api import Page

from lippmann.job.messages.orders import TaskKind
from service.schemas.access import Role
from tests.browser.conftest import Farm
from tests.waiting import until


@dataclass
class Visit:
    """A visit of all states: a page, its farm, and the jobs that some states share."""

    page: Page
    farm: Farm
    jobs: dict[str, str] = field(default_factory=dict)
    """The ids of jobs by what they are: `done`, `failed`, `cancelled`, `running`."""

    def log_in(self, role: Role = Role.ADMIN) -> None:
        """Log in with a new key; an earlier session ends."""
        self.page.context.clear_cookies()
        self.page.goto(self.farm.url)
        self.page.get_by_label("API key").fill(self.farm.service.new_key(role))
        self.page.get_by_role("button", name="Log in").click()
        self.page.get_by_role("heading", name="Jobs").wait_for()

    def go(self, fragment: str) -> None:
        """Open a place of the page, with a fresh start."""
        self.page.goto("about:blank")
        self.page.goto(f"{self.farm.url}/{fragment}")

    def done(self) -> str:
        """Return the id of a finished job."""
        if "done" not in self.jobs:
            self.jobs["done"] = self.farm.submit(title="A pond")
            self._ends("done")
        return self.jobs["done"]

    def failed(self) -> str:
        if "failed" not in self.jobs:
            self.farm.studio.faults[TaskKind.RENDER, 3] = "Parse Error: Undeclared identifier 'wafer'.\n" * 3
            self.jobs["failed"] = self.farm.submit(title="A pond with a mistake")
            self._ends("failed")
            self.farm.studio.faults.clear()
        return self.jobs["failed"]

    def running(self) -> str:
        if "running" not in self.jobs:
            self.jobs["running"] = self.farm.submit_held()
        return self.jobs["running"]

    def _ends(self, status: str) -> None:
        until(lambda: self.farm.service.status(self.jobs[status]) == status)


def _login(visit: Visit) -> None:
    visit.go("")
    visit.page.get_by_label("API key").wait_for()


def _login_refused(visit: Visit) -> None:
    visit.go("?refused=1")
    visit.page.get_by_role("alert").get_by_text("unknown").wait_for()


def _no_such_page(visit: Visit) -> None:
    visit.go("nothing/here")
    visit.page.get_by_role("heading").first.wait_for()


def _api(visit: Visit) -> None:
    visit.log_in()
    visit.go("docs")
    visit.page.get_by_role("heading").first.wait_for()


def _help(visit: Visit) -> None:
    visit.go("help/job-file.html#rig.lens_array.offset_mm")
    visit.page.get_by_role("heading", name="The job file").wait_for()


def _no_jobs(visit: Visit) -> None:
    visit.log_in()
    visit.go("#/")


def _new_job(visit: Visit) -> None:
    visit.go("#/new")
    visit.page.get_by_label("Title").wait_for()


def _new_job_begun(visit: Visit) -> None:
    visit.page.get_by_label("Title").fill("Half a job")
    visit.page.reload()
    visit.page.get_by_text("This is the form as you left it.").wait_for()


def _job_done(visit: Visit) -> None:
    visit.go(f"#/jobs/{visit.done()}")
    visit.page.get_by_role("heading", name="A pond").first.wait_for()


def _job_failed(visit: Visit) -> None:
    visit.go(f"#/jobs/{visit.failed()}")
    visit.page.get_by_role("heading", name="A pond with a mistake").wait_for()


def _job_removed(visit: Visit) -> None:
    visit.go("#/jobs/20260101-000000-aaaa")


def _at(fragment: str, heading: str) -> Callable[[Visit], None]:
    """Return how to go to a page with a heading."""

    def go(visit: Visit) -> None:
        visit.go(fragment)
        visit.page.get_by_role("heading", name=heading).first.wait_for()

    return go


def _looking(query: str) -> Callable[[Visit], None]:
    """Return how to open the viewer of the finished job in a state."""

    def go(visit: Visit) -> None:
        visit.go(f"#/jobs/{visit.done()}?{query}")
        visit.page.get_by_role("heading", name="A pond").first.wait_for()

    return go


def _nothing_found(visit: Visit) -> None:
    visit.go("#/?search=nothing-like-this")
    visit.page.get_by_role("heading", name="Jobs").wait_for()


def _compare(visit: Visit) -> None:
    visit.go(f"#/compare/{visit.done()}/{visit.failed()}")
    visit.page.get_by_role("heading").first.wait_for()


def _job_running(visit: Visit) -> None:
    visit.go(f"#/jobs/{visit.running()}")
    visit.page.get_by_role("button", name="Pause").wait_for()


def _order_of_work(visit: Visit) -> None:
    visit.running()
    visit.go("#/?sort=work")
    visit.page.get_by_role("button", name="Place of").first.wait_for()


def _as_viewer(visit: Visit) -> None:
    visit.log_in(Role.VIEWER)
    visit.go(f"#/jobs/{visit.running()}")
    visit.page.get_by_role("heading", name="A pond").first.wait_for()


STATES: Mapping[str, Callable[[Visit], None]] = MappingProxyType(
    {
        "login": _login,
        "login-refused": _login_refused,
        "no-such-page": _no_such_page,
        "api": _api,
        "help": _help,
        "no-jobs": _no_jobs,
        "new-job": _new_job,
        "new-job-begun": _new_job_begun,
        "job-done": _job_done,
        "focus": _looking("look=focus"),
        "depth-map": _looking("look=look&map=1"),
        "stereo": _looking("look=look&eyes=side_by_side"),
        "observer": _looking("look=observer"),
        "sheet": _looking("look=sheet"),
        "job-failed": _job_failed,
        "compare": _compare,
        "nothing-found": _nothing_found,
        "job-removed": _job_removed,
        "wrong-address": _at("#/nothing", "There is no such page"),
        "farm": _at("#/farm", "Farm"),
        "account": _at("#/account", "Your account"),
        "keys": _at("#/keys", "Keys"),
        "audit-log": _at("#/audit", "Audit log"),
        "job-running": _job_running,
        "order-of-work": _order_of_work,
        "job-running-viewer": _as_viewer,
    }
)
"""The states by name, in the order in which they are visited: each may rely on the login of those before."""


@dataclass(frozen=True)
class Screen:
    """A screen on which the page is shown."""

    name: str
    width: int
    height: int
    scheme: Literal["light", "dark"]


SCREENS = (
    Screen("light", 1366, 768, "light"),
    Screen("dark", 1366, 768, "dark"),
    Screen("phone", 390, 844, "light"),
)

QUIET = """() => {
  const isSeen = ({ top, bottom, left, right }) => top < innerHeight && bottom > 0 && left < innerWidth && right > 0;
  const isAway = (image) => image.loading === "lazy" && !isSeen(image.getBoundingClientRect());
  return document.readyState === "complete" && !document.querySelector("[aria-busy=true]")
    && [...document.images].every((image) => image.complete || isAway(image));
}"""
"""Browsers may load a lazy picture that is not on the screen, or leave it."""


def settle(page: Page) -> None:
    """Wait until the page has loaded what it shows, and has drawn it."""
    page.wait_for_load_state("load")
    page.wait_for_function(QUIET)
    page.evaluate("() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
