"""Login with an account, against a provider that really signs and that lies on request."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import select

from service.db.tables import AuditRow, Credential
from service.oidc import provider as module
from service.schemas.access import Role
from tests.builders_service import T0, Client, Farm
from tests.openid_provider import (
    CLIENT_ID,
    CLIENT_SECRET,
    Lies,
    Provider,
    changed_after_signing,
    running_provider,
    signed_with_another_key,
    signed_with_the_public_key,
    unsigned,
)

HTML = {"Accept": "text/html"}
COOKIE, LOGIN_COOKIE = "lippmann_session", "lippmann_login"
ANN = {"name": "Ann", "role": "submitter", "owner_id": "oidc:ann-1"}


@dataclass
class Door:
    """A farm with a provider, and a browser without a key."""

    farm: Farm
    provider: Provider
    browser: Client

    def begin(self) -> str:
        """Go to the provider, and return where it leads the browser back to."""
        answer = self.browser.get("/login/oidc", follow_redirects=False)
        assert answer.status_code == 303, answer.text
        back = httpx.get(answer.headers["Location"], follow_redirects=False).headers["Location"]
        base_url = self.farm.settings.base_url
        assert back.startswith(f"{base_url}/login/oidc/callback?")
        return str(back.removeprefix(base_url))

    def come_back(self, url: str, **headers: str) -> httpx.Response:
        answer: httpx.Response = self.browser.get(url, headers=headers, follow_redirects=False)
        return answer

    def log_in(self) -> httpx.Response:
        return self.come_back(self.begin())

    @property
    def session(self) -> Any:
        answer = self.browser.get("/api/v1/session")
        return answer.json() if answer.status_code == 200 else answer.status_code


@pytest.fixture(scope="module")
def shared_provider() -> Iterator[Provider]:
    with running_provider(lambda: T0) as provider:
        yield provider


@pytest.fixture
def provider(shared_provider: Provider) -> Provider:
    """Lend the provider, which is honest again."""
    shared_provider.lies, shared_provider.now_s = Lies(), lambda: T0
    shared_provider.asked.clear()
    return shared_provider


@pytest.fixture
def door(
    provider: Provider, make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], tmp_path: Path
) -> Door:
    secret = tmp_path / "client.secret"
    secret.write_text(CLIENT_SECRET + "\n")
    secret.chmod(0o600)
    farm = make_farm(
        coordinator=False, redis_url="redis://127.0.0.1:1/0", oidc_issuer=provider.url, oidc_client_id=CLIENT_ID,
        oidc_client_secret_file=secret, oidc_roles={"lab": Role.SUBMITTER}, oidc_name="the lab",
        failed_logins_per_minute=1000,
    )  # fmt: skip
    provider.now_s = lambda: farm.now_s
    browser = make_client(farm)
    del browser.headers["Authorization"]
    return Door(farm, provider, browser)


def test_an_account_opens_a_session_of_its_own_owner(door: Door) -> None:
    answer = door.log_in()
    assert (answer.status_code, answer.headers["Location"]) == (303, "/?entered=1")
    cookies = [text.lower() for text in answer.headers.get_list("set-cookie")]
    (session,) = [text for text in cookies if text.startswith(COOKIE)]
    assert "samesite=strict" in session
    assert "httponly" in session
    assert door.session == ANN
    assert LOGIN_COOKIE not in door.browser.cookies
    with door.farm.database.reading() as rows:
        entry = rows.scalars(select(AuditRow)).one()
        assert (entry.action, entry.name, entry.detail) == ("log-in", "Ann", "owner oidc:ann-1")
    door.farm.now_s += door.farm.settings.oidc_session_s + 1
    assert door.session == 401


def test_the_login_page_leads_on_a_browser_that_withholds_its_new_cookie(door: Door) -> None:
    # Strict cookies stay away while a page of the provider leads the browser.
    page = door.browser.get("/", params={"entered": "1"}).text
    assert '<meta http-equiv="refresh" content="0; url=/">' in page
    assert "refresh" not in door.browser.get("/").text


def test_a_login_ends_the_session_that_the_browser_had_before_and_logging_out_ends_it(door: Door) -> None:
    door.log_in()
    before = door.browser.cookies[COOKIE]
    door.log_in()
    after = door.browser.cookies[COOKIE]
    assert after != before
    door.browser.post("/logout", headers={"X-Lippmann-Request": "1"}, follow_redirects=False)
    door.browser.cookies.clear()
    for cookie in (before, after):
        assert door.browser.get("/api/v1/session", headers={"Cookie": f"{COOKIE}={cookie}"}).status_code == 401
    with door.farm.database.reading() as rows:
        assert rows.scalars(select(Credential)).all()[1:] == []  # the key of the fixture is left


LIES: dict[str, Lies] = {
    "another nonce": Lies({"nonce": "another"}),
    "no nonce": Lies({"nonce": None}),
    "another audience": Lies({"aud": "another"}),
    "another audience, by this party": Lies({"aud": "another", "azp": CLIENT_ID}),
    "an audience among others for another party": Lies({"aud": [CLIENT_ID, "another"], "azp": "another"}),
    "no audience": Lies({"aud": None}),
    "another issuer": Lies({"iss": "https://another.example"}),
    "expired": Lies({"exp": int(T0) - 61}),
    "no expiry": Lies({"exp": None}),
    "issued in the future": Lies({"iat": int(T0) + 3600}),
    "no subject": Lies({"sub": None}),
    "another access token": Lies({"at_hash": "x"}),
    "no signature": Lies(sign=unsigned),
    "the public key as a shared secret": Lies(sign=signed_with_the_public_key),
    "another key": Lies(sign=signed_with_another_key),
    "changed claims": Lies(sign=changed_after_signing),
    "no token": Lies(sign=lambda _provider, _claims: ""),
    "another text": Lies(sign=lambda _provider, _claims: "a.b.c"),
    "a huge token": Lies(sign=lambda _provider, _claims: "a" * 250_000),
}


@pytest.mark.promise(
    "People",
    "An ID token that is not signed, is meant for another party, has expired or is of another login opens nothing.",
)
def test_a_token_that_is_not_as_it_must_be_opens_nothing(door: Door) -> None:
    answers = {}
    for lie, door.provider.lies in LIES.items():
        answer = door.log_in()
        answers[lie] = (answer.status_code, answer.json()["code"], door.session)
    assert answers == dict.fromkeys(LIES, (401, "unauthorized", 401))
    door.provider.lies = Lies()
    door.log_in()
    assert door.session == ANN


CHANGES: dict[str, Callable[[str], str]] = {
    "another state": lambda url: url + "x",
    "no state": lambda url: url.replace("state=", "stat="),
    "no code": lambda url: url.replace("code=", "cod="),
    "an error": lambda url: url + "&error=access_denied",
    "another issuer": lambda url: url + "&iss=https://another.example",
}


def test_an_answer_that_belongs_to_another_login_opens_nothing(door: Door) -> None:
    for name, change in CHANGES.items():
        url = door.begin()
        assert door.come_back(change(url)).status_code == 401, name
        assert door.come_back(url).status_code == 401, name  # a login is over after its first answer
    assert "token" not in door.provider.asked
    assert door.session == 401


@pytest.mark.promise("People", "The answer of an OpenID provider opens nothing in another browser.")
def test_the_answer_of_a_provider_opens_nothing_in_another_browser(door: Door) -> None:
    url = door.begin()
    cookie = door.browser.cookies[LOGIN_COOKIE]
    door.browser.cookies.clear()
    assert door.come_back(url).status_code == 401
    state, nonce, verifier = cookie.split(".")
    for other in (f"{state}.{nonce}.{'v' * 43}", f"{state}.{'n' * 43}.{verifier}", state, f"{state}..", ""):
        answer = door.come_back(url, Cookie=f"{LOGIN_COOKIE}={other}")
        assert answer.status_code == 401, other
    assert door.session == 401


@pytest.mark.promise("People", "A code of an OpenID provider works once.")
def test_a_code_works_once(door: Door) -> None:
    url = door.begin()
    cookie = door.browser.cookies[LOGIN_COOKIE]
    assert door.come_back(url).status_code == 303
    door.browser.cookies.clear()
    again = door.come_back(url, Cookie=f"{LOGIN_COOKIE}={cookie}")
    assert (again.status_code, again.json()["code"]) == (401, "unauthorized")


def test_failed_logins_are_limited(
    provider: Provider, make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(
        coordinator=False, redis_url="redis://127.0.0.1:1/0", oidc_issuer=provider.url, oidc_client_id=CLIENT_ID,
        failed_logins_per_minute=2,
    )  # fmt: skip
    browser = make_client(farm)
    statuses = [browser.get("/login/oidc/callback").status_code for _ in range(3)]
    assert statuses == [401, 401, 429]
    assert browser.get("/login/oidc").status_code == 429


DESCRIPTIONS: dict[str, Lies] = {
    "another issuer": Lies(description={"issuer": "https://another.example"}),
    "an open channel": Lies(description={"token_endpoint": "http://id.example/token"}),
    "no address": Lies(description={"jwks_uri": None}),
    "too large": Lies(bytes_more=module.MAX_BYTES),
}


def test_a_provider_that_describes_itself_wrongly_is_not_used_and_asked_again_later(door: Door) -> None:
    for lie, door.provider.lies in DESCRIPTIONS.items():
        answer = door.browser.get("/login/oidc", follow_redirects=False)
        assert (answer.status_code, answer.json()["code"]) == (503, "provider-unavailable"), lie
    door.provider.lies = Lies()
    door.log_in()
    assert door.session == ANN


def test_a_provider_with_an_error_is_named_and_its_user_can_try_again(door: Door) -> None:
    door.provider.lies = Lies(token_status=502)
    answer = door.log_in()
    assert (answer.status_code, answer.json()["code"]) == (503, "provider-unavailable")


def test_a_browser_is_led_to_the_login_page_with_the_reason(door: Door) -> None:
    account = door.provider.account
    door.provider.account = account | {"groups": []}
    refused = door.come_back(door.begin(), **HTML)
    door.provider.account = account
    assert refused.headers["Location"] == "/?refused=account"
    assert "Your account has no access" in door.browser.get("/?refused=account").text
    assert door.come_back("/login/oidc/callback", **HTML).headers["Location"] == "/?refused=login"
    assert "has failed" in door.browser.get("/?refused=login").text


def test_the_description_is_kept_and_new_keys_are_read_when_they_are_used(door: Door) -> None:
    door.log_in()
    door.log_in()
    assert door.provider.asked == ["description", "keys", "token", "token"]
    door.provider.new_key()
    assert door.log_in().status_code == 401  # the keys were read just now
    openid: module.Provider = door.browser.app.state.openid  # type: ignore[attr-defined]
    steady = openid.steady
    openid.steady = lambda: steady() + module.RENEWED_AFTER_S
    assert door.log_in().status_code == 303
    assert door.session == ANN


def test_a_link_of_another_site_logs_nobody_in(door: Door) -> None:
    for site in ("cross-site", "same-site"):
        answer = door.come_back("/login/oidc", **{"Sec-Fetch-Site": site})
        assert (answer.status_code, answer.headers["Location"]) == (303, "/")
    assert LOGIN_COOKIE not in door.browser.cookies


def test_behind_tls_no_other_site_can_set_the_cookie_of_a_login(
    provider: Provider, make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(
        coordinator=False, redis_url="redis://127.0.0.1:1/0", oidc_issuer=provider.url, oidc_client_id=CLIENT_ID,
        public_url="https://farm.example",
    )  # fmt: skip
    answer = make_client(farm).get("/login/oidc", follow_redirects=False)
    cookie = answer.headers["Set-Cookie"]
    assert cookie.startswith("__Host-lippmann_login=")
    assert "; Secure" in cookie
    assert "redirect_uri=https%3A%2F%2Ffarm.example%2Flogin%2Foidc%2Fcallback" in answer.headers["Location"]


def test_without_the_setting_there_is_neither_a_route_nor_a_button(api: Client, door: Door) -> None:
    assert 'href="/login/oidc">Log in with the lab</a>' in door.browser.get("/").text
    del api.headers["Authorization"]
    assert "/login/oidc" not in api.get("/").text
    assert api.get("/login/oidc").status_code == 404
    assert api.get("/login/oidc/callback").status_code == 404


def test_the_libraries_of_the_login_are_imported_only_for_it() -> None:
    code = (
        "import sys, service.main, lippmann.cli.main; print(*(n for n in ('authlib', 'joserfc') if n in sys.modules))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == []
