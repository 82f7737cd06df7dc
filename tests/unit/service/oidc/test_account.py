"""Who an account is on the farm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from lippmann.errors import BadInput
from service.oidc.account import Account, AccountRefused, LoginRefused, account_of
from service.schemas.access import Role
from service.settings import Settings

ROLES = {"lab": Role.SUBMITTER, "guests": Role.VIEWER, "operators": Role.ADMIN}


def _settings(**more: Any) -> Settings:
    return Settings(oidc_issuer="https://id.example", oidc_client_id="farm", oidc_roles=ROLES, **more)


def test_an_account_owns_jobs_under_its_subject_and_has_the_highest_role_of_its_groups() -> None:
    claims = {"sub": "1", "email": "ann@example", "groups": ["guests", "lab", "others"]}
    assert account_of(claims, _settings()) == Account("oidc:1", "ann@example", Role.SUBMITTER)
    assert account_of(claims | {"groups": "operators"}, _settings()).role is Role.ADMIN


@pytest.mark.parametrize("groups", [[], ["lab2"], None, {"lab": 1}, [["lab"]], 7])
def test_an_account_without_a_known_group_is_refused_unless_there_is_a_role_for_all(groups: Any) -> None:
    claims = {"sub": "1", "groups": groups}
    with pytest.raises(AccountRefused, match="'1' has no access"):
        account_of(claims, _settings())
    assert account_of(claims, _settings(oidc_default_role=Role.VIEWER)).role is Role.VIEWER


def test_groups_may_be_in_a_claim_inside_others_or_in_one_with_dots_in_its_name() -> None:
    settings = _settings(oidc_roles_claim="realm.roles")
    for groups in ({"realm": {"roles": ["lab"]}}, {"realm.roles": ["lab"]}):
        assert account_of({"sub": "1", **groups}, settings).role is Role.SUBMITTER
    with pytest.raises(AccountRefused):
        account_of({"sub": "1", "realm": "roles"}, settings)


@pytest.mark.parametrize("subject", [None, 1, "", "s" * 96, "a\nb", "\u202ea"])
def test_a_subject_that_cannot_name_an_owner_is_refused(subject: Any) -> None:
    with pytest.raises(LoginRefused, match="expected a subject"):
        account_of({"sub": subject, "groups": ["lab"]}, _settings())


def test_a_name_that_cannot_be_shown_is_left_out() -> None:
    claims = {"sub": "1", "groups": ["lab"], "name": "a\u202eb", "preferred_username": "ann"}
    assert account_of(claims, _settings()).name == "ann"


def test_the_settings_of_the_provider_are_checked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="expected an https URL"):
        Settings(oidc_issuer="http://id.example", oidc_client_id="farm")
    with pytest.raises(BadInput, match="LIPPMANN_OIDC_CLIENT_ID"):
        Settings(oidc_issuer="https://id.example")
    monkeypatch.setenv("LIPPMANN_OIDC_ROLES", '{"CN=lab, OU=x": "submitter"}')
    assert Settings(data_dir=tmp_path).oidc_roles == {"CN=lab, OU=x": Role.SUBMITTER}
