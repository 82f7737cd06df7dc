"""The keys of the farm, which only admins see."""

from __future__ import annotations

from collections.abc import Callable

import httpx
from playwright.sync_api import Page, expect

from service.schemas.access import Role
from tests.browser.conftest import Farm


def test_an_admin_makes_a_key_whose_secret_is_shown_once_and_revokes_it(
    page: Page, farm: Farm, log_in: Callable[[str], Page]
) -> None:
    log_in(farm.service.new_key(Role.ADMIN))
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


def test_others_have_no_link_to_the_keys(page: Page, log_in: Callable[[], Page]) -> None:
    log_in()
    expect(page.get_by_role("button", name="Log out")).to_be_visible()
    expect(page.get_by_role("link", name="Keys", exact=True)).to_have_count(0)
