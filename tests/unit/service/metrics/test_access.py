"""Who reads the figures without a key."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import BadInput
from service.metrics.access import SHORTEST_TOKEN, MonitorAccess
from service.settings import Settings

TOKEN = "a-token-of-the-operator"


def admits(
    settings: Settings, *, address: str = "192.0.2.9", forwarded: bool = False, header: str | None = None
) -> bool:
    return MonitorAccess(settings).admits(address=address, is_forwarded=forwarded, authorization=header)


def private_file(path: Path, text: str) -> Path:
    path.touch(0o600)
    path.write_text(text)
    return path


def test_nobody_is_let_in_unless_the_operator_says_so() -> None:
    assert not admits(Settings(), address="127.0.0.1")
    assert not admits(Settings(), header="Bearer ")


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        (f"Bearer {TOKEN}", True),
        (f"bearer  {TOKEN} ", True),
        (f"Bearer {TOKEN}x", False),
        (f"Basic {TOKEN}", False),
        (TOKEN, False),
        ("Bearer é\udc80", False),
        (None, False),
    ],
)
def test_whoever_has_the_token_is_let_in(tmp_path: Path, header: str | None, expected: bool) -> None:
    private_file(tmp_path / "token", f"{TOKEN}\n")
    assert admits(Settings(metrics_token_file=tmp_path / "token"), header=header) is expected


def test_a_new_token_counts_at_once_and_the_old_one_no_longer(tmp_path: Path) -> None:
    file = private_file(tmp_path / "token", TOKEN)
    access = MonitorAccess(Settings(metrics_token_file=file))

    def admitted(token: str) -> bool:
        return access.admits(address="", is_forwarded=False, authorization=f"Bearer {token}")

    file.write_text("another-token-of-the-operator")
    assert (admitted(TOKEN), admitted("another-token-of-the-operator")) == (False, True)
    file.write_text("")
    assert not admitted("")
    file.unlink()
    assert not admitted(TOKEN)


def test_a_file_that_is_missing_or_too_short_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"LIPPMANN_METRICS_TOKEN_FILE: expected a file of a token that can be read, got .*none"
    ):
        MonitorAccess(Settings(metrics_token_file=tmp_path / "none"))
    private_file(tmp_path / "short", "x" * (SHORTEST_TOKEN - 1) + "\n")
    with pytest.raises(BadInput, match=r"at least 20 characters in .*short, got 19"):
        MonitorAccess(Settings(metrics_token_file=tmp_path / "short"))


def test_a_file_that_others_may_read_is_refused_at_the_start_and_later(tmp_path: Path) -> None:
    file = private_file(tmp_path / "token", TOKEN)
    file.chmod(0o440)  # as in a Secret of Kubernetes
    access = MonitorAccess(Settings(metrics_token_file=file))
    assert access.admits(address="", is_forwarded=False, authorization=f"Bearer {TOKEN}")
    file.chmod(0o644)
    assert not access.admits(address="", is_forwarded=False, authorization=f"Bearer {TOKEN}")
    with pytest.raises(BadInput, match=r"LIPPMANN_METRICS_TOKEN_FILE: expected .*only its user.* with mode 0644"):
        MonitorAccess(Settings(metrics_token_file=file))


@pytest.mark.parametrize(
    ("address", "forwarded", "proxies", "expected"),
    [
        ("10.1.2.3", False, "", True),
        ("11.1.2.3", False, "", False),
        ("fd00::1", False, "", True),
        ("testclient", False, "", False),
        # The address is that of a proxy which is not trusted, so anybody may have sent the request.
        ("10.1.2.3", True, "", False),
        ("10.1.2.3", True, "192.0.2.1", True),
    ],
)
def test_listed_addresses_are_let_in_unless_they_are_those_of_a_proxy(
    address: str, forwarded: bool, proxies: str, expected: bool
) -> None:
    settings = Settings(metrics_networks="10.0.0.0/8, fd00::/8", trusted_proxies=proxies)
    assert admits(settings, address=address, forwarded=forwarded) is expected
