"""The audit log: who changed what, when, and from where. An entry is stored in the transaction of the change."""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.auth import Caller
from service.db.tables import AuditRow
from service.schemas.access import AuditAction


def record(
    session: Session, caller: Caller, action: AuditAction, subject: str, *, now_s: float, detail: str = ""
) -> None:
    """Append an entry for a change that a caller makes in this transaction."""
    session.add(
        AuditRow(
            at_s=now_s,
            key_id=caller.key_id,
            name=caller.name,
            role=caller.role.value,
            action=action.value,
            subject=subject,
            detail=detail,
            address=caller.address,
            request_id=caller.request_id,
        )
    )
    session.flush()
