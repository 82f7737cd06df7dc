"""The client of a service: its jobs, scenes, files and keys. docs/command.md has an example."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from http import HTTPStatus
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar
from urllib.parse import quote

from pydantic import BaseModel, ValidationError

from lippmann.client.address import environment_address
from lippmann.client.errors import NotLippmann, Refused
from lippmann.client.names import plain_name
from lippmann.client.stream import ServerEvent
from lippmann.client.transport import PATIENCE_S, Download, Response, Transport
from lippmann.errors import BadInput, JobEnded
from lippmann.job.spec import JobSpec
from lippmann.job.states import ENDED_JOBS
from lippmann.untrusted.shown import shown
from service.schemas.access import AuditEntry, AuditPage, Key, KeyList, LoginLink, NewKey, Session
from service.schemas.artifact import Artifact, ArtifactLink, ArtifactPage
from service.schemas.events import (
    EventTopic,
    JobEvent,
    JobRemoved,
    ProgressEvent,
    ResetEvent,
    StreamEvent,
    StreamMessage,
)
from service.schemas.farm import Health, WaitingWork, WorkerList
from service.schemas.frame import Frame, FramePage
from service.schemas.job import Job, JobPage, JobSort
from service.schemas.scene import Scene, SceneList
from service.schemas.task import Task, TaskPage
from service.schemas.usage import Usage
from service.schemas.viewing import FocusDepth, FrameViews
from service.schemas.webhook import WebhookSecret
from service.schemas.work import FarmHistory, FarmWork, OwnerWork, OwnerWorkList
from service.schemas.worker_keys import BrokerUser, NewWorkerKey, WorkerKey, WorkerKeyList

if TYPE_CHECKING:
    from service.schemas.design import Design
    from service.schemas.preview import Preview

_PAGE = 500
"""The largest page that the service returns."""
_API = "/api/v1"
PREVIEW_S = 75.0
"""The time within which a preview is answered; a service gives it up after at most 60 s."""

FramePicture = Literal["view", "perspective", "refocus", "observer", "views.atlas", "depth.map"]
"""A picture that the service makes of a frame on demand."""

Shape = TypeVar("Shape", bound=BaseModel)


class Client:
    """A client of a farm over HTTP. It is a context manager, and several threads may use it at the same time.

    Parameters
    ----------
    url, key
        The service and a key to it. They are found as the command finds them: the defaults are `LIPPMANN_URL` and
        `LIPPMANN_KEY`, and without a URL the farm that `lippmann up` runs on `data_dir`.
    data_dir
        The data folder of such a farm. The default is `LIPPMANN_DATA_DIR`, or `data`.
    patience_s
        How long the client retries a service that does not answer, s.

    Raises
    ------
    lippmann.errors.Unreachable
        If there is neither a URL nor a farm; and in every method, if the service does not answer.
    lippmann.client.Refused
        In every method, if the service refuses; `problems` names the invalid fields.
    """

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        *,
        data_dir: Path | None = None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        address = environment_address(url=url, key=key, data_dir=data_dir)
        self.address = address
        self._transport = Transport(address, patience_s=patience_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close every connection."""
        self._transport.close()

    # Jobs

    def submit(
        self, job: JobSpec | Mapping[str, Any], *, idempotency_key: str | None = None, webhook: str | None = None
    ) -> Job:
        """Submit a job, as a `JobSpec` or as the JSON of a job file. A retry never creates a second job.

        The URL `webhook` gets a signed message when the job has ended; see docs/webhooks.md.
        """
        headers = {"Idempotency-Key": idempotency_key or uuid.uuid4().hex}
        params = {} if webhook is None else {"webhook": webhook}
        answer = self._transport.request(
            "POST", f"{_API}/jobs", params=params, json=_job_file(job), headers=headers, repeatable=True
        )
        return _answered(Job, answer)

    def design(self, job: JobSpec | Mapping[str, Any], *, frame: int | None = None) -> Design:
        """Return what a job will give, without storing it, for a frame or for the first one; see docs/designer.md."""
        from service.schemas.design import Design  # on first use: it imports NumPy

        params = {} if frame is None else {"frame": str(frame)}
        answer = self._transport.request("POST", f"{_API}/design", params=params, json=_job_file(job), repeatable=True)
        return _answered(Design, answer)

    def preview(
        self,
        job: JobSpec | Mapping[str, Any],
        *,
        frame: int | None = None,
        lenses: int | None = None,
        px_per_lens: int | None = None,
        stream: str = "",
    ) -> Preview:
        """Render one small frame of a job at once, and store nothing; see docs/http-api.md.

        Parameters
        ----------
        frame
            The number of the frame; by default the first one of the job.
        lenses, px_per_lens
            The largest size of the preview; by default 45 lenses across and down, of 8 pixels.
        stream
            The name of a series of previews, of which the newest alone is answered.
        """
        from service.schemas.preview import Preview  # on first use, as in `design`

        given = {"frame": frame, "lenses": lenses, "px_per_lens": px_per_lens, "stream": stream or None}
        params = {name: str(value) for name, value in given.items() if value is not None}
        answer = self._transport.request(
            "POST", f"{_API}/preview", params=params, json=_job_file(job), timeout=PREVIEW_S
        )
        return _answered(Preview, answer)

    def job(self, job_id: str) -> Job:
        """Return the current state of a job."""
        return self._get(Job, f"/jobs/{plain_name(job_id)}")

    def jobs(
        self,
        *,
        status: str | None = None,
        owner: str | None = None,
        search: str | None = None,
        sort: JobSort | None = None,
        ascending: bool = False,
        limit: int | None = None,
    ) -> Iterator[Job]:
        """Yield the jobs, newest first unless `sort` says otherwise, at most `limit` of them.

        Parameters
        ----------
        status, owner
            Only the jobs with this status, and those of the owner of this name or id.
        search
            Only the jobs with this text in their title, scene, owner or id.
        """
        given = {"status": status, "owner": owner, "search": search, "sort": sort and sort.value}
        params = {name: value for name, value in given.items() if value} | ({"ascending": "true"} if ascending else {})
        return _first(limit, self._paged(JobPage, "/jobs", params, limit))

    def cancel(self, job_id: str) -> Job:
        """Cancel a job; its finished frames and outputs are kept."""
        return self._act(job_id, "cancel")

    def pause(self, job_id: str) -> Job:
        """Pause a job: running tasks finish, and no new task starts."""
        return self._act(job_id, "pause")

    def resume(self, job_id: str) -> Job:
        """Resume a paused job."""
        return self._act(job_id, "resume")

    def retry(self, job_id: str) -> Job:
        """Run the failed and cancelled tasks of an ended job again."""
        return self._act(job_id, "retry")

    def repair(self, job_id: str) -> Job:
        """Verify every artifact of an ended job, and make the missing and damaged ones again."""
        return self._act(job_id, "repair")

    def skip(self, job_id: str, frames: Iterable[int] | None = None) -> Job:
        """Leave frames of a failed or cancelled job out, by default those that failed, and continue the job."""
        body = {"frames": None if frames is None else list(frames)}
        return _answered(Job, self._transport.request("POST", f"{_API}/jobs/{plain_name(job_id)}/skip", json=body))

    def prioritise(self, job_id: str, priority: int) -> Job:
        """Set the priority of a job, 0 to 100."""
        return _answered(
            Job, self._transport.request("PATCH", f"{_API}/jobs/{plain_name(job_id)}", json={"priority": priority})
        )

    def share(self, job_id: str, *, shared: bool = True) -> Job:
        """Show a job to everybody with a key, or only to its owner, on a farm that hides jobs from other owners."""
        return _answered(
            Job, self._transport.request("PATCH", f"{_API}/jobs/{plain_name(job_id)}", json={"shared": shared})
        )

    def delete(self, job_id: str) -> None:
        """Delete an ended job and its files."""
        _check_done(self._transport.request("DELETE", f"{_API}/jobs/{plain_name(job_id)}"))

    def tasks(
        self, job_id: str, *, status: str | None = None, kind: str | None = None, limit: int | None = None
    ) -> Iterator[Task]:
        """Yield the tasks of a job in order, at most `limit` of them, only those of a status or a kind if given."""
        params = {name: value for name, value in (("status", status), ("kind", kind)) if value}
        return _first(limit, self._paged(TaskPage, f"/jobs/{plain_name(job_id)}/tasks", params, limit))

    def task(self, job_id: str, task_id: str) -> Task:
        """Return a task of a job."""
        return self._get(Task, f"/jobs/{plain_name(job_id)}/tasks/{plain_name(task_id)}")

    def restart_task(self, job_id: str, task_id: str) -> Task:
        """Stop the attempt that owns a task. The task runs again, on another worker if there is one."""
        return self._act_on_task(job_id, task_id, "restart")

    def end_task(self, job_id: str, task_id: str) -> Task:
        """End a running task for good; its job fails, or only the output that it makes."""
        return self._act_on_task(job_id, task_id, "end")

    def log(self, job_id: str, task_id: str, *, attempt: int | None = None) -> str:
        """Return the log of the latest attempt of a task, or of the attempt with the given number."""
        params = {"attempt": str(attempt)} if attempt else {}
        return self._transport.request(
            "GET", f"{_API}/jobs/{plain_name(job_id)}/tasks/{plain_name(task_id)}/log", params=params
        ).text

    def frames(self, job_id: str, *, limit: int | None = None) -> Iterator[Frame]:
        """Yield the frames of a job in order, at most `limit` of them."""
        return _first(limit, self._paged(FramePage, f"/jobs/{plain_name(job_id)}/frames", {}, limit))

    # Events

    def events(self, job_id: str | None = None, *, last_id: str | None = None) -> Iterator[ServerEvent]:
        """Yield the events of a job, or of all jobs, without end; a broken stream is resumed after the last event.

        The stream of one job begins with its current state. After a `reset` event, which comes when events between the
        last one and this one are no longer stored, the caller reads anew what it keeps.
        """
        params = {"job": job_id} if job_id else {}
        return self._transport.events(f"{_API}/events", params=params, last_id=last_id)

    def follow(self, job_id: str) -> Iterator[Job]:
        """Yield a job whenever it changes, until it has ended.

        Raises
        ------
        JobEnded
            If the job is removed meanwhile.
        """
        job = self.job(job_id)
        yield job
        if job.status in ENDED_JOBS:
            return
        for event in self.events(job_id):
            message = _message(event)
            if isinstance(message, JobEvent):
                if isinstance(message.data, JobRemoved):
                    raise JobEnded(f"job {job_id} was removed")
                job = message.data
            elif isinstance(message, ProgressEvent):
                job = job.model_copy(update=dict(message.data))
            elif isinstance(message, ResetEvent):
                job = self._job_still_there(job_id)
            else:
                continue
            yield job
            if job.status in ENDED_JOBS:
                return

    def _job_still_there(self, job_id: str) -> Job:
        try:
            return self.job(job_id)
        except Refused as error:
            if error.status == HTTPStatus.NOT_FOUND:
                raise JobEnded(f"job {job_id} was removed") from error
            raise

    # Files

    def artifacts(self, job_id: str, *, prefix: str = "") -> Iterator[Artifact]:
        """Yield the files of a job whose names begin with `prefix`, in the order of their names."""
        params = {"prefix": prefix} if prefix else {}
        return self._paged(ArtifactPage, f"/jobs/{plain_name(job_id)}/artifacts", params, None)

    def download(
        self,
        job_id: str,
        name: str,
        path: Path,
        *,
        format: Literal["png"] | None = None,  # noqa: A002 - the name of the parameter in the API
        bits: Literal[8, 16] = 8,
        on_bytes: Callable[[int], None] | None = None,
        sleep: Callable[[float], None] | None = None,
        waits_for_repair: Callable[[], bool] = lambda: True,
    ) -> Download:
        """Download a file of a job to `path`, atomically; `format="png"` converts a master to sRGB.

        `on_bytes` is called with the number of bytes of each part that has come. `sleep` waits for a number of
        seconds between two attempts. An exception of either ends the download. `waits_for_repair` returns whether the
        download waits for a file that the farm makes again; it does so for a limited time.
        """
        url = f"{_API}/jobs/{plain_name(job_id)}/artifacts/{name}"
        how: dict[str, Any] = {"on_bytes": on_bytes, "sleep": sleep, "waits_for_repair": waits_for_repair}
        if format is None:
            return self._transport.download(url, path, **how)
        return self._transport.download_made(url, path, params={"format": format, "bits": str(bits)}, **how)

    def download_output(self, job_id: str, name: str, path: Path) -> Download:
        """Download all files of an output, such as `view_grid.png`, to `path` as one zip, atomically."""
        return self._transport.download_made(
            f"{_API}/jobs/{plain_name(job_id)}/outputs/{plain_name(name)}.zip", path, params={}
        )

    def artifact_link(self, job_id: str, name: str, *, expires_in_s: float | None = None) -> ArtifactLink:
        """Create a link with which anybody downloads one file of a job without a key, by default for a day."""
        body = {"artifact": name, "expires_in_s": expires_in_s}
        return _answered(
            ArtifactLink, self._transport.request("POST", f"{_API}/jobs/{plain_name(job_id)}/links", json=body)
        )

    # Pictures of a frame

    def frame_views(self, job_id: str, frame: int) -> FrameViews:
        """Return the views of a frame."""
        return self._get(FrameViews, f"/jobs/{plain_name(job_id)}/frames/{frame}/look")

    def focus_depth(self, job_id: str, frame: int, *, x: float, y: float) -> FocusDepth:
        """Return the depth to which to refocus a frame, so that what is at a place is sharp.

        Parameters
        ----------
        x, y
            The place in the refocused picture, as parts of its width from the left and of its height from the top.
        """
        return self._get(FocusDepth, f"/jobs/{plain_name(job_id)}/frames/{frame}/depth?x={x:g}&y={y:g}")

    def download_picture(
        self, job_id: str, frame: int, what: FramePicture, path: Path, **parameters: str | float
    ) -> Download:
        """Download a picture that the service makes of a frame to `path`, atomically.

        Parameters
        ----------
        what
            The kind of picture: `view`, `perspective`, `refocus`, `observer`, `views.atlas` or `depth.map`.
        parameters
            Its parameters in the API, for example `u=3, v=4`, `depth_mm=20`, `scale=4`, `format="exr"`.
        """
        url = f"{_API}/jobs/{plain_name(job_id)}/frames/{frame}/{what}"
        return self._transport.download_made(url, path, params={name: f"{one}" for name, one in parameters.items()})

    # Scenes

    def scenes(self) -> Iterator[Scene]:
        """Yield the scenes in the order of their names."""
        return self._paged(SceneList, "/scenes", {}, None)

    def scene(self, name: str) -> Scene:
        """Return a scene."""
        return self._get(Scene, f"/scenes/{plain_name(name)}")

    def remove_scene(self, name: str) -> None:
        """Remove an uploaded scene. Jobs that were submitted with it keep it."""
        _check_done(self._transport.request("DELETE", f"{_API}/scenes/{plain_name(name)}"))

    def upload_scene(self, name: str, bundle_zip: bytes) -> Scene:
        """Upload a scene: a zip of scene.toml and the files of the scene."""
        files = {"bundle": (f"{name}.zip", bundle_zip, "application/zip")}
        # The request may be repeated, because the service returns the same scene for the same content.
        answer = self._transport.request("POST", f"{_API}/scenes", params={"name": name}, files=files, repeatable=True)
        return _answered(Scene, answer)

    # The farm

    def health(self) -> Health:
        """Return the health of the farm."""
        return self._get(Health, "/health")

    def caller(self) -> Session:
        """Return the name, the role and the owner of the key."""
        return self._get(Session, "/session")

    def workers(self) -> WorkerList:
        """Return the connected workers."""
        return self._get(WorkerList, "/workers")

    def waiting(self) -> WaitingWork:
        """Return the work that waits for slots and that has some."""
        return self._get(WaitingWork, "/waiting")

    def drain(self, worker: str, *, ends: bool = False) -> None:
        """Let a worker take no further orders; it finishes its tasks. This needs an admin key.

        With `ends`, the worker process ends afterwards. A restart of the worker ends the drain.
        """
        _check_done(
            self._transport.request("PUT", f"{_API}/workers/{quote(worker, safe='')}/drain", json={"ends": ends})
        )

    def undrain(self, worker: str) -> None:
        """Let a worker that was drained take orders again. This needs an admin key."""
        _check_done(self._transport.request("DELETE", f"{_API}/workers/{quote(worker, safe='')}/drain"))

    def exclude(self, worker: str) -> None:
        """Let a worker take no further orders, however often it restarts. This needs an admin key."""
        _check_done(self._transport.request("PUT", f"{_API}/workers/{quote(worker, safe='')}/exclusion"))

    def include(self, worker: str) -> None:
        """Let a worker that was excluded take orders again. This needs an admin key."""
        _check_done(self._transport.request("DELETE", f"{_API}/workers/{quote(worker, safe='')}/exclusion"))

    def forgive(self, worker: str) -> None:
        """Forget the failures of a worker, so that no job avoids it. This needs an admin key."""
        _check_done(self._transport.request("DELETE", f"{_API}/workers/{quote(worker, safe='')}/faults"))

    def farm_work(self) -> FarmWork:
        """Return what workers run, which of it seems to be stuck, and which jobs wait and why."""
        return self._get(FarmWork, "/farm")

    def farm_history(self, *, hours: int = 24) -> FarmHistory:
        """Return how many frames were finished and how many slots were in use in the last hours."""
        return _answered(
            FarmHistory, self._transport.request("GET", f"{_API}/farm/history", params={"hours": str(hours)})
        )

    def farm_owners(self) -> tuple[OwnerWork, ...]:
        """Return what the stored jobs of each owner took."""
        return self._get(OwnerWorkList, "/farm/owners").items

    def keys(self) -> tuple[Key, ...]:
        """Return every key without its secret."""
        return self._get(KeyList, "/keys").items

    def create_key(
        self,
        name: str,
        role: str,
        *,
        owner_id: str | None = None,
        expires_in_days: float | None = None,
        limits: Mapping[str, float] | None = None,
    ) -> NewKey:
        """Create a key with the role `viewer`, `submitter` or `admin`. Only this answer contains its secret.

        Keys with the same `owner_id` own the same jobs and scenes; without one, the key is its own owner.
        `limits` are lower ones than those of the farm, by the names of `service.schemas.access.KeyLimits`.
        """
        options = {"owner_id": owner_id, "expires_in_days": expires_in_days, "limits": limits}
        body = {"name": name, "role": role} | {field: value for field, value in options.items() if value is not None}
        return _answered(NewKey, self._transport.request("POST", f"{_API}/keys", json=body))

    def worker_keys(self) -> tuple[WorkerKey, ...]:
        """Return every worker key without its secret."""
        return self._get(WorkerKeyList, "/worker-keys").items

    def create_worker_key(
        self,
        name: str,
        *,
        expires_in_days: float | None = None,
        pool: str = "",
        tags: Sequence[str] = (),
        broker_user: BrokerUser = "own",
    ) -> NewWorkerKey:
        """Create a worker key with its join file, which only this answer contains. `revoke_key` revokes it.

        With the `broker_user` `given`, the join file has no user and no password at the broker, and you add them.
        """
        options: dict[str, Any] = {"expires_in_days": expires_in_days} if expires_in_days is not None else {}
        body = {"name": name, "pool": pool, "tags": list(tags), "broker_user": broker_user} | options
        return _answered(NewWorkerKey, self._transport.request("POST", f"{_API}/worker-keys", json=body))

    def usage(self) -> Usage:
        """Return what the owner of the key uses of the farm, and the limits of the key."""
        return self._get(Usage, "/usage")

    def webhook_secret(self) -> WebhookSecret:
        """Return the secret with which a receiver verifies the webhooks of the caller's jobs."""
        return self._get(WebhookSecret, "/webhook-secret")

    def revoke_key(self, key_id: str) -> None:
        """Revoke a key, also one of a worker. The browser sessions that it opened and their streams end at once."""
        _check_done(self._transport.request("DELETE", f"{_API}/keys/{plain_name(key_id)}"))

    def audit(
        self,
        *,
        limit: int | None = None,
        action: str | None = None,
        name: str | None = None,
        subject: str | None = None,
    ) -> Iterator[AuditEntry]:
        """Yield the changes that were made through the API, newest first, at most `limit` of them.

        With `action`, such as `remove-job`, only these are returned; with `name`, those by a key with this name or id;
        with `subject`, those of a job, a task, a scene, a key or a worker.
        """
        asked = {"action": action, "name": name, "subject": subject}
        params = {field: value for field, value in asked.items() if value is not None}
        return _first(limit, self._paged(AuditPage, "/audit", params, limit))

    def login_link(self) -> LoginLink:
        """Create a link that logs a browser in once, within a short time."""
        return _answered(LoginLink, self._transport.request("POST", f"{_API}/login-tokens"))

    def _get(self, shape: type[Shape], path: str) -> Shape:
        return _answered(shape, self._transport.request("GET", _API + path))

    def _act(self, job_id: str, action: str) -> Job:
        return _answered(Job, self._transport.request("POST", f"{_API}/jobs/{plain_name(job_id)}/{action}"))

    def _act_on_task(self, job_id: str, task_id: str, action: str) -> Task:
        path = f"{_API}/jobs/{plain_name(job_id)}/tasks/{plain_name(task_id)}/{action}"
        return _answered(Task, self._transport.request("POST", path))

    def _paged(self, page: type[BaseModel], path: str, params: Mapping[str, str], limit: int | None) -> Iterator[Any]:
        query = dict(params) | {"limit": str(min(limit or _PAGE, _PAGE))}
        while True:
            answer: Any = _answered(page, self._transport.request("GET", _API + path, params=query))
            yield from answer.items
            if answer.next_cursor is None:
                return
            query["cursor"] = answer.next_cursor


def _first(limit: int | None, items: Iterator[Shape]) -> Iterator[Shape]:
    for count, item in enumerate(items):
        if count == limit:
            return
        yield item


def _job_file(job: object) -> dict[str, Any]:
    """Return a job as JSON.

    Raises
    ------
    BadInput
        If it is no mapping of JSON values.
    """
    if isinstance(job, JobSpec):
        return job.model_dump(mode="json", exclude_none=True)
    if not isinstance(job, Mapping):
        raise BadInput(f"expected a job as a mapping or a JobSpec, got {shown(job)}")
    try:
        json.dumps(dict(job), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise BadInput(f"expected a job of values that JSON has, got one that it has not: {error}") from error
    return dict(job)


def _answered(shape: type[Shape], response: Response) -> Shape:
    """Return what a response contains.

    Raises
    ------
    NotLippmann
        If it has something else: the URL is that of another service, or that service has another version.
    """
    try:
        # A newer service may return fields that this client does not know.
        return shape.model_validate(response.json(), extra="ignore")
    except ValidationError as error:
        problem, *_ = error.errors()
        where = ".".join(map(str, problem["loc"])) or "content"
        got = f"one without {where!r}" if problem["type"] == "missing" else f"one with another {where!r}"
        raise NotLippmann.at(response.url, got) from error
    except ValueError as error:
        kind = response.headers.get("Content-Type", "bytes").partition(";")[0]
        raise NotLippmann.at(response.url, f"one of {kind}") from error


def _check_done(response: Response) -> None:
    if response.status_code not in (HTTPStatus.NO_CONTENT, HTTPStatus.NOT_FOUND):  # See `Transport.request` for 404.
        raise NotLippmann.at(response.url, f"{response.status_code}")


def _message(event: ServerEvent) -> StreamEvent | None:
    """Return an event by its schema; None for a kind of event that only a newer service knows."""
    if event.type not in set(EventTopic):
        return None
    return StreamMessage.model_validate({"event": event.type, "data": event.data}, extra="ignore").root
