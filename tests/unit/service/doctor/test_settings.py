"""What the doctor says of settings that contradict each other."""

from __future__ import annotations

from typing import Any

import pytest

from service.doctor.finding import Level
from service.doctor.settings import check_settings
from service.settings import Settings

FARM: dict[str, Any] = {"store_url": "s3://farm", "public_url": "https://farm.example"}


@pytest.mark.parametrize(
    ("changes", "is_noted"),
    [
        ({"s3_endpoint": "http://store:8333"}, True),
        ({"s3_public_endpoint": "http://s3.example"}, True),
        ({"s3_endpoint": "http://store:8333", "s3_public_endpoint": "https://s3.example"}, False),
        ({}, False),
        ({"s3_endpoint": "http://store:8333", "public_url": "http://farm.example"}, False),
    ],
)
def test_a_bucket_that_clients_of_a_service_with_https_do_not_use_is_noted(
    changes: dict[str, str], is_noted: bool
) -> None:
    found = [one for one in check_settings(Settings(**FARM | changes)) if "S3_PUBLIC_ENDPOINT" in one.message]
    assert [one.level for one in found] == ([Level.NOTE] if is_noted else [])
