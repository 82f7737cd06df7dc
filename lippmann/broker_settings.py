"""The settings that the service and the workers have in common: broker, store, keys of messages, log."""

from __future__ import annotations

import logging
import os
import re
from pathlib import Path
from typing import Any

from pydantic import ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict, SettingsError

from lippmann.errors import BadInput
from lippmann.job.fields.old_names import rename_settings
from lippmann.job.fields.problem_words import expected_words, got_words
from lippmann.job.messages import wire
from lippmann.job.messages.seals import Seals
from lippmann.key_file import ORDER_KEY_FILE, KeyFile, read_secret
from lippmann.logs import LogFormat

STORE_URL = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,61}[a-z0-9](/[A-Za-z0-9_-][A-Za-z0-9._-]*)*/?")
ENDPOINT_URL = re.compile(r"https?://[^/@\s]+/?")


class BrokerSettings(BaseSettings):
    """Settings of a process that sends and receives messages; they come from environment variables LIPPMANN_...

    Raises
    ------
    BadInput
        If a value is invalid, with the name of its variable.
    """

    model_config = SettingsConfigDict(
        env_prefix="LIPPMANN_", env_ignore_empty=True, frozen=True, use_attribute_docstrings=True
    )

    data_dir: Path = Path("data")
    """The folder of what the process stores; the store of artifacts in it is common to the service and the workers."""
    store_url: str = ""
    """The store of artifacts: `s3://bucket` or `s3://bucket/prefix`; if empty, the folder `artifacts` in `data_dir`. It
    needs the extra `s3` of the package."""
    s3_endpoint: str = ""
    """The URL of the S3 server of the store; if empty, Amazon's."""
    s3_region: str = ""
    """The region of the bucket; if empty, that of the AWS settings of the machine, or `us-east-1`."""
    redis_url: str = "redis://127.0.0.1:6379/0"
    """The URL of the broker: `redis://`, `rediss://` or `unix://`."""
    redis_password_file: Path | None = None
    """The file of the password of the broker, which then appears in no environment and in no log."""
    redis_ca_file: Path | None = None
    """The certificates that sign the one of a broker at `rediss://`; if empty, those of the system."""
    order_key_file: Path | None = None
    """The file of the keys that sign orders and events; if empty, `order.key` in `data_dir`. The service writes it if
    it does not exist."""
    accept_unsigned: bool = False
    """True while the farm has processes of a version that does not sign its messages."""
    log_format: LogFormat = "plain"
    """The form of the log: `plain` lines, or `json`, one object a line."""
    telemetry_url: str = ""
    """The URL of an OpenTelemetry collector that gets traces by OTLP over HTTP, such as `http://collector:4318`; if
    empty, none are made. It needs the extra `telemetry` of the package."""

    @field_validator("store_url")
    @classmethod
    def _check_store(cls, text: str) -> str:
        if text and not STORE_URL.fullmatch(text):
            raise ValueError(f"expected s3://bucket or s3://bucket/prefix, got {text!r}")
        return text

    @field_validator("s3_endpoint", "telemetry_url", "s3_public_endpoint", check_fields=False)
    @classmethod
    def _check_endpoint(cls, text: str) -> str:
        if text and not ENDPOINT_URL.fullmatch(text):
            raise ValueError(f"expected the URL of a server, such as https://s3.example:8333, got {text!r}")
        return text

    def __init__(self, **values: Any) -> None:
        for note in rename_settings(os.environ):
            logging.getLogger(__name__).warning(note)
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise BadInput(_problem(error)) from None  # The error has the values, and some are secrets.
        except SettingsError as error:  # It names the setting, and not the value.
            raise BadInput(f"expected JSON where a setting is an object, got another text: {error}") from None

    @property
    def broker(self) -> str:
        """The URL of the broker with its password and its certificates; it is never logged."""
        password = read_secret(self.redis_password_file) if self.redis_password_file else ""
        return wire.full_redis_url(self.redis_url, password=password, ca_file=str(self.redis_ca_file or ""))

    @property
    def order_keys(self) -> KeyFile:
        """The keys that sign orders and events."""
        return KeyFile(self.order_key_file or self.data_dir / ORDER_KEY_FILE)

    @property
    def seals(self) -> Seals:
        """The seals of the messages between the service and the workers."""
        return Seals(self.order_keys.keys, accept_unsigned=self.accept_unsigned)


def _problem(error: ValidationError) -> str:
    """Return the first problem with the variable of the environment; a value that may have a password is left out."""
    item: Any = error.errors(include_url=False)[0]
    words = expected_words(item)
    if not item["loc"]:
        return words
    name = str(item["loc"][0])
    if item["type"] == "value_error":  # The words of a check of ours end with the value.
        words = words.partition(", got ")[0].removeprefix("expected ")
    is_secret = name.endswith(("_url", "_endpoint")) or "@" in str(item["input"])
    return (
        f"LIPPMANN_{name.upper()}: expected {words}, got {'another value' if is_secret else got_words(item['input'])}"
    )
