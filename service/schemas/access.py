"""Keys and login links."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from pydantic import Field

from service.schemas.answer import Answer, RequestBody

PRINTABLE = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]+$"
"""The pattern of a name: no control characters, and none that change the direction of the text around it."""


class Role(StrEnum):
    """The role of a key. Each role includes the rights of those before it: viewer, submitter, admin."""

    VIEWER = "viewer"
    SUBMITTER = "submitter"
    ADMIN = "admin"

    def allows(self, needed: Role) -> bool:
        """Return whether this role includes the rights of `needed`."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class KeyLimits(RequestBody):
    """The limits of a key that are lower than those of the farm; null for the limit of the farm."""

    memory_mb: int | None = Field(default=None, ge=128)
    """The largest `render.memory_mb` of a job."""
    timeout_s: float | None = Field(default=None, ge=1)
    """The longest time limit in `render` of a job."""
    frame_px: int | None = Field(default=None, ge=1)
    """The largest number of pixels that are rendered for a frame."""
    job_px: int | None = Field(default=None, ge=1)
    """The largest number of pixels that are rendered for a job."""
    frames: int | None = Field(default=None, ge=1)
    """The largest number of frames of a job."""
    tasks: int | None = Field(default=None, ge=1)
    """The largest number of tasks of a job, whose automatic tiles count as one."""
    open_jobs: int | None = Field(default=None, ge=1)
    """The largest number of open jobs of the owner with which this key submits another one."""
    open_frames: int | None = Field(default=None, ge=1)
    """The largest number of frames in the open jobs of the owner, the submitted one included."""
    slots: int | None = Field(default=None, ge=1)
    """The largest number of slots that the jobs of the owner hold at once while a job of this key gets another one."""
    scenes: int | None = Field(default=None, ge=1)
    """The largest number of scenes of the owner with which this key uploads another one."""
    bundles: int | None = Field(default=None, ge=1)
    """The largest number of scene bundles of the owner, replaced ones included, when this key uploads another one."""
    bundles_mb: int | None = Field(default=None, ge=1)
    """The largest size of the scene bundles of the owner in megabytes, the uploaded one included."""
    picture_s_per_minute: float | None = Field(default=None, gt=0)
    """The seconds a minute for which pictures on demand of the key are made."""
    artifacts_mb: int | None = Field(default=None, ge=1)
    """The size of the artifacts of the owner in megabytes above which jobs of this key are paused, and this key
    submits no other ones."""


class KeyRequest(RequestBody):
    """A request for a new key."""

    name: str = Field(min_length=1, max_length=64, pattern=PRINTABLE)
    """The name of the key, shown with the jobs that it submits."""
    role: Role = Role.SUBMITTER
    owner_id: str | None = Field(default=None, min_length=1, max_length=100, pattern=PRINTABLE)
    """The owner of the jobs and scenes of the key. Keys with the same owner may change each other's; null for a key
    that is its own owner."""
    expires_in_days: float | None = Field(default=None, gt=0, le=36_500)
    """The time until the key expires; null for a key that does not."""
    limits: KeyLimits = KeyLimits()
    """The limits of the key, where they are lower than those of the farm."""


class Key(Answer):
    """A key, without its secret."""

    id: str
    name: str
    role: Role
    owner_id: str
    """The owner of the jobs and scenes of the key: its own id, or a name that it shares with other keys."""
    created_at: datetime
    expires_at: datetime | None
    """The time after which the key is refused; null for a key that does not expire."""
    used_at: datetime | None
    """The time of the last request with the key or with a browser session that it opened, exact to a minute; null
    before the first."""
    limits: KeyLimits


class NewKey(Answer):
    """A new key with its secret, which cannot be retrieved later."""

    id: str
    name: str
    role: Role
    owner_id: str
    expires_at: datetime | None
    limits: KeyLimits
    key: str
    """The secret to send as `Authorization: Bearer <key>`."""


class KeyList(Answer):
    """All keys, oldest first."""

    items: tuple[Key, ...]


class BrowserSession(Answer):
    """An open browser session."""

    id: str
    name: str
    """The name of the key that opened it, or of the account."""
    role: Role
    owner_id: str
    key_id: str | None
    """The key that opened it, with which it ends; null if it was opened by an account or by a link of the farm."""
    created_at: datetime
    expires_at: datetime | None
    used_at: datetime | None
    """The time of its last request, exact to a minute; null before the first."""


class BrowserSessionList(Answer):
    """The open browser sessions, newest first, at most 1000."""

    items: tuple[BrowserSession, ...]


class LoginLink(Answer):
    """A link that logs in one browser, once."""

    url: str
    expires_at: datetime


class Session(Answer):
    """The caller of the request."""

    name: str
    role: Role
    owner_id: str
    """The owner of the jobs and scenes of the caller, who changes those with the same `owner_id`; admins change all."""


class AuditAction(StrEnum):
    """A change that the audit log records."""

    SUBMIT_JOB = "submit-job"
    PRIORITISE_JOB = "prioritise-job"
    SHARE_JOB = "share-job"
    CANCEL_JOB = "cancel-job"
    PAUSE_JOB = "pause-job"
    RESUME_JOB = "resume-job"
    RETRY_JOB = "retry-job"
    REPAIR_JOB = "repair-job"
    SKIP_FRAMES = "skip-frames"
    RESTART_TASK = "restart-task"
    END_TASK = "end-task"
    REMOVE_JOB = "remove-job"
    LINK_ARTIFACT = "link-artifact"
    UPLOAD_SCENE = "upload-scene"
    REMOVE_SCENE = "remove-scene"
    CREATE_KEY = "create-key"
    REVOKE_KEY = "revoke-key"
    CREATE_WORKER_KEY = "create-worker-key"
    CREATE_LOGIN_LINK = "create-login-link"
    LOG_IN = "log-in"
    LOG_OUT = "log-out"
    END_SESSION = "end-session"
    DRAIN_WORKER = "drain-worker"
    UNDRAIN_WORKER = "undrain-worker"
    EXCLUDE_WORKER = "exclude-worker"
    INCLUDE_WORKER = "include-worker"
    FORGIVE_WORKER = "forgive-worker"


class AuditEntry(Answer):
    """A change that somebody made: who, what, when, from where."""

    id: int
    at: datetime
    key_id: str
    """The key of the caller, which may have been revoked since."""
    name: str
    """The name of that key."""
    role: Role
    action: AuditAction
    subject: str
    """The job, the task, the scene, the key, the browser session or the worker that was changed."""
    detail: str
    """The new state of the subject, such as `priority 80`; empty if the action says it all."""
    address: str
    """The address from which the request came."""
    request_id: str


class AuditPage(Answer):
    """A page of the audit log, newest first."""

    items: tuple[AuditEntry, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""
