"""What a job will give."""

from __future__ import annotations

from worker.plan.design import Design

__all__ = ["Design"]
