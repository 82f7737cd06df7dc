"""Login with an account in Chromium, with the provider on another site: strict cookies, and the policy of the page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from service.schemas.access import Role
from service.settings import Settings
from tests.broker import Broker
from tests.browser.conftest import PATIENCE_MS
from tests.builders_service import parts
from tests.integration.service.conftest import Service
from tests.openid_provider import CLIENT_ID, CLIENT_SECRET, Provider, running_provider


@pytest.fixture
def provider() -> Iterator[Provider]:
    with running_provider(time.time) as provider:
        # To a browser this is another site than 127.0.0.1, where the farm is.
        provider.url = provider.url.replace("127.0.0.1", "localhost")
        yield provider


def test_an_account_opens_the_dashboard_across_sites(
    chromium: Browser, broker: Broker, provider: Provider, tmp_path: Path
) -> None:
    secret = tmp_path / "client.secret"
    secret.write_text(CLIENT_SECRET)
    secret.chmod(0o600)
    settings = Settings(
        data_dir=tmp_path, redis_url=broker.url, oidc_issuer=provider.url, oidc_client_id=CLIENT_ID,
        oidc_client_secret_file=secret, oidc_roles={"lab": Role.SUBMITTER}, oidc_name="the lab",
    )  # fmt: skip
    service = Service(settings, parts())
    service.app.state.openid.settings = settings.model_copy(update={"public_url": service.url})
    context = chromium.new_context()
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(service.url)
    page.get_by_role("link", name="Log in with the lab").click()
    page.get_by_role("link", name="I am Ann").click()
    expect(page.get_by_text("No jobs yet.")).to_be_visible()
    assert page.url.startswith(f"{service.url}/#")
    expect(page.get_by_role("button", name="Log out")).to_have_attribute("title", "Logged in as Ann (submitter)")
    context.close()
    service.stop()
