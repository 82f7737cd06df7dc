"""The keys of the farm, which only admins see."""

from __future__ import annotations

import re
from collections.abc import Callable

import httpx
from playwright.sync_api import Page, expect

from service.schemas.access import Role
from tests.browser.conftest import Farm


def test_an_admin_makes_a_key_whose_secret_is_shown_once_and_revokes_it(
    page: Page, farm: Farm, log_in: Callable[[str], Page]
) -> None:
    log_in(farm.service.new_key(Role.ADMIN))
    page.get_by_role("link", name="Account", exact=True).click()
    page.get_by_role("link", name="Keys", exact=True).click()
    form = page.get_by_role("form", name="New key")
    form.get_by_label("Name").fill("lab")
    form.get_by_label("Role").select_option("viewer")
    form.get_by_label("Expires in").fill("2")
    form.get_by_role("button", name="Create a key").click()
    secret = page.get_by_role("status", name="New key").locator("code").inner_text()
    asked = {"Authorization": f"Bearer {secret}"}
    assert httpx.get(f"{farm.url}/api/v1/session", headers=asked).json()["name"] == "lab"
    page.get_by_role("button", name="I have it").click()
    expect(page.get_by_text(secret)).to_have_count(0)
    page.get_by_role("button", name="Revoke lab").click()
    page.get_by_role("button", name="Revoke the key").click()
    expect(page.get_by_role("button", name="Revoke lab")).to_have_count(0)
    assert httpx.get(f"{farm.url}/api/v1/session", headers=asked).status_code == 401
    expect(page.get_by_role("table", name="Browser sessions").get_by_role("row")).to_have_count(2)


def test_others_see_their_own_limits_and_neither_keys_nor_the_audit_log(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.submit_held()
    log_in()
    page.get_by_role("link", name="Account", exact=True).click()
    expect(page.get_by_role("row", name=re.compile("^Open jobs"))).to_contain_text("set by the farm")
    expect(page.get_by_role("progressbar", name=re.compile("^Open jobs:"))).to_be_visible()
    expect(page.get_by_role("link", name="Keys", exact=True)).to_have_count(0)
    for address, what in (("keys", "the keys"), ("audit", "the audit log")):
        page.goto(f"{farm.url}/#/{address}")
        expect(page.get_by_text(f"Only admins see {what}.")).to_be_visible()


def test_an_admin_finds_in_the_audit_log_who_changed_what(
    page: Page, farm: Farm, log_in: Callable[[str], Page]
) -> None:
    job_id = farm.submit()
    farm.service.client.patch(f"/jobs/{job_id}", json={"priority": 80})
    log_in(farm.service.new_key(Role.ADMIN))
    page.get_by_role("link", name="Account", exact=True).click()
    page.get_by_role("link", name="Audit log", exact=True).click()
    rows = page.get_by_role("table", name="Audit log").get_by_role("row")
    expect(rows).to_have_count(4)  # the head, the login, the priority, the submission
    page.get_by_label("Action").select_option("prioritise-job")
    expect(rows).to_have_count(2)
    expect(rows.nth(1)).to_contain_text("priority 80")
    assert page.url.endswith("#/audit?action=prioritise-job")
    page.get_by_label("Subject").fill("nothing")
    expect(page.get_by_text("No entry fits the filter.")).to_be_visible()
    page.get_by_label("Subject").fill("")
    rows.nth(1).get_by_role("link", name=job_id).click()
    expect(page.get_by_role("heading", name="A pond")).to_be_visible()
