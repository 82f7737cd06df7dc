"""The design of a job file."""

from __future__ import annotations

from lippmann.plan.design.design import Design

__all__ = ["Design"]
