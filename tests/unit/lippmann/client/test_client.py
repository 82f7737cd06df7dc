"""The client sends what it is asked for, and refuses ids and names that would lead elsewhere."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.client import Client
from lippmann.client.transport import Transport
from lippmann.errors import BadInput, Unreachable


@pytest.mark.parametrize("name", ["a/tasks", "../health", "..", "", "a?limit=3", "a#b", "a b", "caf\udce9"])
def test_an_id_that_would_be_another_request_is_refused_and_not_sent(name: str) -> None:
    with Client("http://127.0.0.1:1", "key", patience_s=0.0) as client:
        for ask in (client.job, client.scene, client.cancel, client.revoke_key, client.remove_scene):
            with pytest.raises(BadInput, match="expected an id or a name of letters, digits, dots and dashes, got"):
                ask(name)
        with pytest.raises(Unreachable):
            client.job("1m8mag7sjk5kz3zk6")


@pytest.mark.parametrize(("webhook", "expected"), [(None, {}), ("", {"webhook": ""}), ("u", {"webhook": "u"})])
def test_an_empty_webhook_is_left_to_the_service_to_refuse(
    webhook: str | None, expected: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def request(self: Transport, method: str, path: str, **parts: Any) -> None:
        assert parts["params"] == expected
        raise Unreachable("asked")

    monkeypatch.setattr(Transport, "request", request)
    with Client("http://127.0.0.1:1", "key") as client, pytest.raises(Unreachable, match="asked"):
        client.submit({}, webhook=webhook)
