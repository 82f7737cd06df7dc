"""Traces for OpenTelemetry: spans of requests, plans, orders and attempts, sent by OTLP over HTTP.

Every job is a trace, whose id follows from that of the job: its plan and its orders are spans of it, and an attempt is
a child of its order, which carries the context. Nothing is sent, and no exporter is imported, unless a process has
called `start_telemetry`.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import TYPE_CHECKING

from lippmann.errors import BadInput

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.trace import Span as LibrarySpan
    from opentelemetry.trace import SpanContext

EVERY_MS = 1000
"""The interval at which spans are sent. A pool process that is killed loses those since the last time."""
TIMEOUT_S = 3
"""The longest time of one exchange with the collector."""
_CONTEXT = re.compile(r"00-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})")
"""The `traceparent` of the W3C: version, trace, span, flags."""

_provider: TracerProvider | None = None


class Span:
    """A span that is being measured; it does nothing in a process without telemetry."""

    def __init__(self, inner: LibrarySpan | None) -> None:
        self._inner = inner

    @property
    def context(self) -> str | None:
        """The `traceparent` of spans below this one; None without telemetry."""
        if self._inner is None:
            return None
        found = self._inner.get_span_context()
        return f"00-{found.trace_id:032x}-{found.span_id:016x}-{int(found.trace_flags):02x}"

    def rename(self, name: str) -> None:
        """Give the span the name that is known only at its end."""
        if self._inner is not None:
            self._inner.update_name(name)

    def note(self, **attributes: str | int | None) -> None:
        """Add attributes; one without a value is left out."""
        if self._inner is not None:
            for name, value in attributes.items():
                if value is not None:
                    self._inner.set_attribute(f"lippmann.{name}", value)

    def end(self) -> None:
        """Stop the clock."""
        if self._inner is not None:
            self._inner.end()

    def fail(self, code: str) -> None:
        """Note that what is measured failed, with the code of the error."""
        if self._inner is not None:
            from opentelemetry.trace import Status, StatusCode

            self._inner.set_status(Status(StatusCode.ERROR, code))


_NOTHING = Span(None)


def start_telemetry(url: str, *, process: str, instance: str) -> None:
    """Send spans of this process to a collector from now on; does nothing without a URL.

    Parameters
    ----------
    url
        The collector, such as `http://collector:4318`.
    process
        The kind of the process, such as `lippmann-worker`.
    instance
        The name of this process among those of its kind.

    Raises
    ------
    BadInput
        If the extra `telemetry` is not installed.
    """
    global _provider
    if not url:
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ModuleNotFoundError as error:
        raise BadInput(
            f"LIPPMANN_TELEMETRY_URL needs the extra `telemetry`: pip install lippmann[telemetry] ({error})"
        ) from error
    about = {"service.name": process, "service.version": version("lippmann"), "service.instance.id": instance}
    _provider = TracerProvider(resource=Resource(about), shutdown_on_exit=False)
    exporter = OTLPSpanExporter(endpoint=f"{url.rstrip('/')}/v1/traces", timeout=TIMEOUT_S)
    _provider.add_span_processor(BatchSpanProcessor(exporter, schedule_delay_millis=EVERY_MS))


def stop_telemetry() -> None:
    """Send the spans that have ended, and no others."""
    global _provider
    provider, _provider = _provider, None
    if provider is not None:
        provider.shutdown()


@contextmanager
def span(name: str, *, parent: str | None = None, **attributes: str | int | None) -> Iterator[Span]:
    """Measure what is done in the context.

    Parameters
    ----------
    parent
        The `traceparent` of the span above it; None, or one that is malformed, begins a trace.
    """
    if _provider is None:
        yield _NOTHING
        return
    from opentelemetry.context import Context
    from opentelemetry.trace import NonRecordingSpan, set_span_in_context

    above = _context_of(parent)
    context = Context() if above is None else set_span_in_context(NonRecordingSpan(above), Context())
    made = Span(_provider.get_tracer("lippmann").start_span(name, context=context))
    made.note(**attributes)
    try:
        yield made
    except BaseException as error:
        made.fail(type(error).__name__)
        raise
    finally:
        made.end()


def context_of_job(job_id: str) -> str:
    """Return the `traceparent` of the spans of a job.

    >>> context_of_job("1q9gd6e00mbne4fz7")
    '00-e028f818b12043e4c20b33b8f1cd58f8-19c1709fe28881de-01'
    """
    digest = hashlib.sha256(f"job {job_id}".encode()).hexdigest()
    return f"00-{digest[:32]}-{digest[32:48]}-01"


def _context_of(parent: str | None) -> SpanContext | None:
    found = None if parent is None else _CONTEXT.fullmatch(parent)
    if found is None:
        return None
    from opentelemetry.trace import SpanContext, TraceFlags

    trace, above, flags = (int(part, 16) for part in found.groups())
    context = SpanContext(trace, above, is_remote=True, trace_flags=TraceFlags(flags))
    return context if context.is_valid else None
