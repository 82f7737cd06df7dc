"""The page of the farm: a real worker is drained and takes orders again, and the tasks of another are seen."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import update

from lippmann.job.states import TaskStatus
from service.db.tables import Task
from service.schemas.access import Role
from tests.broker import Broker
from tests.browser.conftest import Farm, Watch
from tests.browser.test_phone import TOO_WIDE_PX
from tests.builders_messages import put_presence
from tests.builders_service import presence
from tests.farm import LIPPMANN
from tests.needs import needs_povray
from tests.waiting import ENOUGH_S, until

SILENT_S = 16.0
"""Longer than a third of the time after which an attempt is lost."""
POOL = "night"
"""The pool of the real worker, which so takes no orders of the worker that the test plays."""


@pytest.fixture
def render_7(farm: Farm, broker: Broker, tmp_path: Path) -> Iterator[str]:
    """Lend the name of a real worker that is about to be online."""
    env = {
        **os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(tmp_path),
        "LIPPMANN_WORKER_NAME": "render-7",
    }  # fmt: skip
    assert farm.service.settings.data_dir == tmp_path
    with ExitStack() as stack:
        process = subprocess.Popen([LIPPMANN, "worker", "--slots", "2", "--pool", POOL], env=env)
        stack.callback(process.wait, ENOUGH_S)
        stack.callback(process.terminate)
        yield "render-7"


@needs_povray
def test_an_admin_drains_a_real_worker_and_lets_it_take_orders_again(
    page: Page, farm: Farm, broker: Broker, log_in: Callable[[str], Page], render_7: str
) -> None:
    farm.submit_held()
    # While it is held back, the worker that the test plays does not say that it is online.
    put_presence(broker.client, presence("w1"), farm.service.settings.seals, ex=3600)
    log_in(farm.service.new_key(Role.ADMIN))
    page.get_by_role("link", name="Farm", exact=True).click()
    expect(page).to_have_title(re.compile("^Farm . Lippmann$"))
    played = page.get_by_role("listitem", name="w1", exact=True)
    expect(played.get_by_role("link", name="A pond")).to_be_visible()
    expect(played.locator(".badge")).to_have_text("working")
    real = page.get_by_role("listitem", name=render_7, exact=True)
    expect(real.locator(".badge")).to_have_text("idle")
    expect(real.get_by_text(f"Pool{POOL}")).to_be_visible()
    expect(real.get_by_text("POV-Ray 3")).to_be_visible()
    real.get_by_role("button", name="Drain render-7", exact=True).click()
    expect(real.locator(".badge")).to_have_text("drained")
    real.get_by_role("button", name="Undo the drain render-7").click()
    expect(real.locator(".badge")).to_have_text("idle")
    expect(page.locator(".chart canvas")).to_have_count(2)
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate(TOO_WIDE_PX) <= 0


def _fall_silent(farm: Farm, job_id: str) -> str:
    """Wait for a running task of a job, let its worker seem to be silent, and return the id of the task."""
    until(lambda: farm.service.client.get(f"/jobs/{job_id}").json()["tasks"]["running"])
    with farm.service.state.database.writing() as session:
        silent = update(Task).where(Task.job_id == job_id, Task.status == TaskStatus.RUNNING)
        session.execute(silent.values(heartbeat_s=time.time() - SILENT_S))
    (task,) = farm.service.client.get(f"/jobs/{job_id}/tasks", params={"status": "running"}).json()["items"]
    return str(task["id"])


def test_a_stuck_task_runs_again_another_is_ended_and_the_job_is_run_again_changed_retried_and_removed(
    page: Page, farm: Farm, broker: Broker, watch: Watch, log_in: Callable[[], Page]
) -> None:
    failed = farm.submit_held()
    put_presence(broker.client, presence("w1"), farm.service.settings.seals, ex=3600)
    log_in()
    page.get_by_role("link", name="Farm", exact=True).click()
    stuck = page.get_by_role("region", name="Tasks that seem to be stuck")
    _fall_silent(farm, failed)
    stuck.get_by_role("button", name="again").click()
    page.get_by_role("button", name="Run it again").click()
    expect(page.get_by_text("The task runs again.")).to_be_visible()
    outcomes = [item["outcome"] for item in farm.service.client.get(f"/jobs/{failed}/attempts").json()["items"]]
    assert outcomes == ["stopped", "done"]
    farm.studio.let()
    ended = _fall_silent(farm, failed)
    stuck.get_by_role("button", name="End").click()
    page.get_by_role("button", name="End the task").click()
    expect(page.get_by_text("The task has ended.")).to_be_visible()
    error = farm.service.client.get(f"/jobs/{failed}/tasks/{ended}").json()["error"]
    assert (error["code"], farm.service.status(failed)) == ("ended-by-user", "failed")

    page.goto(f"{farm.url}/#/jobs/{failed}")
    page.get_by_text("Job file", exact=True).click()
    page.get_by_role("link", name="Run again changed").click()
    page.get_by_label("Title").fill("A pond, changed")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("heading", level=1, name="A pond, changed")).to_be_visible()

    boxes = page.get_by_role("checkbox", name="Select A pond")
    expect(boxes).to_have_count(2)
    boxes.first.click()
    boxes.last.click()
    several = page.get_by_role("group", name="Selected jobs")
    several.get_by_role("button", name="Retry 1").click()
    expect(several).to_contain_text("1 of 1 job done.")
    several.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Cancel the jobs").click()
    expect(several).to_contain_text("2 of 2 jobs done.")
    several.get_by_role("button", name="Remove").click()
    page.get_by_role("button", name="Remove the jobs").click()
    expect(page.get_by_text("No jobs yet.")).to_be_visible()
    # The job was open when it went, so that the browser may print that its page asked for it.
    page.goto("about:blank")
    watch.complaints[:] = [text for text in watch.complaints if "404" not in text]


def test_others_see_the_farm_and_change_nothing(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    log_in()
    page.get_by_role("link", name="Farm", exact=True).click()
    expect(page.get_by_role("listitem", name="w1", exact=True)).to_be_visible()
    expect(page.get_by_text("No job waits.")).to_be_visible()
    expect(page.get_by_role("article").get_by_role("button")).to_have_count(0)
