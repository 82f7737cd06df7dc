"""Settings that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator

from lippmann.job.messages.wire import HEARTBEAT_S
from service.doctor.finding import Check, Finding, Level
from service.settings import Settings
from service.webhooks.receiver import ReceiverRefused, parse_receiver, rules_of


def check_settings(settings: Settings) -> Iterator[Finding]:
    """Yield the settings that contradict each other or the times of the workers."""
    if settings.lease_ttl_s < 2 * HEARTBEAT_S:
        message = (
            f"LIPPMANN_LEASE_TTL_S: expected at least two heartbeats of {HEARTBEAT_S:g} s, got {settings.lease_ttl_s:g}"
        )
        yield Finding(Check.SETTINGS, Level.WARNING, message)
    if settings.reconcile_s > settings.lease_ttl_s:
        message = (
            f"LIPPMANN_RECONCILE_S: expected at most LIPPMANN_LEASE_TTL_S ({settings.lease_ttl_s:g}), "
            f"got {settings.reconcile_s:g}"
        )
        yield Finding(Check.SETTINGS, Level.WARNING, message)
    if not settings.base_url.startswith(("http://", "https://")):
        message = f"LIPPMANN_PUBLIC_URL: expected http:// or https://, got {settings.base_url!r}"
        yield Finding(Check.SETTINGS, Level.ERROR, message)
    public = settings.s3_public_endpoint or settings.s3_endpoint
    if settings.store_url and settings.base_url.startswith("https://") and public.startswith("http://"):
        message = (
            f"LIPPMANN_S3_PUBLIC_ENDPOINT: expected https:// as in LIPPMANN_PUBLIC_URL, got {public!r}; clients "
            "download nothing from there, so that all files go through the service"
        )
        yield Finding(Check.SETTINGS, Level.NOTE, message)
    if settings.webhook_url:
        try:
            parse_receiver(settings.webhook_url, rules_of(settings))
        except ReceiverRefused as error:
            yield Finding(Check.SETTINGS, Level.ERROR, f"LIPPMANN_WEBHOOK_URL: {error}")
    unused = settings.data_dir / "lippmann.db"
    if settings.database_url and not settings.database_url.endswith(str(unused)) and unused.exists():
        message = f"LIPPMANN_DATABASE_URL names another database, so {unused} is not used"
        yield Finding(Check.SETTINGS, Level.WARNING, message)
