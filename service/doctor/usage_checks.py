"""Invariants of what owners have stored. All of them are read-only queries."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy.orm import Session

from service.db import usage as usage_rows
from service.doctor.finding import Check, Finding, Level


def check_usage(session: Session) -> Iterator[Finding]:
    """Yield the jobs whose bytes are not those of their tasks, and that the bytes of owners are not those of jobs."""
    for job_id, stored, right in usage_rows.miscounted_jobs(session):
        message = f"its artifacts count as {stored} bytes instead of {right}"
        yield Finding(Check.USAGE, Level.ERROR, message, job_id, repairable=True)
    wrong = usage_rows.miscounted_owners(session)
    if wrong:
        shown = "; ".join(f"{owner!r} {stored} instead of {right}" for owner, stored, right in wrong[:5])
        message = f"the artifacts of {len(wrong)} owners are not counted as those of their jobs: {shown}"
        yield Finding(Check.USAGE, Level.ERROR, message, repairable=True)
