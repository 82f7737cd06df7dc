"""What a client expects of the server of the store before it asks it for anything."""

from __future__ import annotations

import pytest

from lippmann.client.direct import NotDirect, StoreServer, expected_sha256

EMPTY = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
FIELD = "sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:"


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        (FIELD, EMPTY),
        (f"sha-512=:AAAA:, {FIELD}", EMPTY),
        ("", None),
        ("md5=:AAAA:", None),
        ("sha-256=:A:", None),
        ("x-sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:", None),
    ],
)
def test_the_digest_of_a_file_is_read_from_its_header(field: str, expected: str | None) -> None:
    assert expected_sha256({"Repr-Digest": field}) == expected


@pytest.mark.parametrize(
    "url", ["http://127.0.0.1:9/a", "ftp://127.0.0.1/a", "file:///etc/passwd", "", "//127.0.0.1/a"]
)
def test_a_client_of_a_service_with_https_goes_to_no_other_kind_of_url(url: str) -> None:
    server = StoreServer(needs_https=True)
    with pytest.raises(NotDirect, match="expected a URL of https"), server.streamed(url, start=0, etag='"a"'):
        pass
    assert server.is_reachable
