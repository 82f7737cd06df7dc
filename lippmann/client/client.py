"""Jobs, scenes, files and keys of a service; docs/command.md has an example."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeVar

from pydantic import BaseModel

from lippmann.client.address import Address, find_address
from lippmann.client.stream import ServerEvent
from lippmann.client.transport import PATIENCE_S, Download, Transport
from lippmann.job.spec import JobSpec
from lippmann.job.states import ENDED_JOBS
from service.schemas.access import Key, KeyList, LoginLink, NewKey
from service.schemas.artifact import Artifact, ArtifactPage
from service.schemas.events import EventTopic, JobEvent, ProgressEvent, StreamEvent, StreamMessage
from service.schemas.farm import Health, WorkerList
from service.schemas.frame import Frame, FramePage
from service.schemas.job import Job, JobPage
from service.schemas.scene import Scene, SceneList
from service.schemas.task import Task, TaskPage
from service.schemas.viewing import Look

_PAGE = 500
"""The longest that the service gives."""
_API = "/api/v1"

Sight = Literal["view", "perspective", "refocus", "observer", "views.atlas"]
"""What a service makes of a frame when it is asked."""

Shape = TypeVar("Shape", bound=BaseModel)


class Client:
    """A farm, spoken to over HTTP. A context manager; not for several threads at once.

    Parameters
    ----------
    url, key
        The service and a key to it; without a URL, the farm that `lippmann up` runs on `data_dir`.
    data_dir
        Where such a farm keeps its data.
    patience_s
        How long a service that does not answer is tried.

    Raises
    ------
    lippmann.errors.Unreachable
        From every method: the service does not answer.
    lippmann.client.Refused
        From every method: the service refuses; `problems` names the fields that are wrong.
    """

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        *,
        data_dir: Path = Path("data"),
        patience_s: float = PATIENCE_S,
    ) -> None:
        address = Address(url, key or "") if url else find_address(url=None, key=key, data_dir=data_dir)
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

    def submit(self, job: JobSpec | Mapping[str, Any], *, idempotency_key: str | None = None) -> Job:
        """Submit a job: as a `JobSpec`, or as the JSON of a job file. It arrives once, however often it is sent."""
        body = job.model_dump(mode="json", exclude_none=True) if isinstance(job, JobSpec) else dict(job)
        headers = {"Idempotency-Key": idempotency_key or uuid.uuid4().hex}
        answer = self._transport.ask("POST", f"{_API}/jobs", json=body, headers=headers, again=True)
        return _shaped(Job, answer.json())

    def job(self, job_id: str) -> Job:
        """Return a job as it stands."""
        return self._get(Job, f"/jobs/{job_id}")

    def jobs(self, *, status: str | None = None, limit: int | None = None) -> Iterator[Job]:
        """Yield jobs, newest first, at most `limit`."""
        params = {"status": status} if status else {}
        return _first(limit, self._paged(JobPage, "/jobs", params, limit))

    def cancel(self, job_id: str) -> Job:
        """End a job; what is done stays."""
        return self._move(job_id, "cancel")

    def pause(self, job_id: str) -> Job:
        """Let nothing new of a job go out."""
        return self._move(job_id, "pause")

    def resume(self, job_id: str) -> Job:
        """Let a paused job go on."""
        return self._move(job_id, "resume")

    def retry(self, job_id: str) -> Job:
        """Let what failed of an ended job run again."""
        return self._move(job_id, "retry")

    def prioritise(self, job_id: str, priority: int) -> Job:
        """Set a job's priority, 0 to 100."""
        return _shaped(Job, self._transport.ask("PATCH", f"{_API}/jobs/{job_id}", json={"priority": priority}).json())

    def delete(self, job_id: str) -> None:
        """Forget an ended job and its files."""
        self._transport.ask("DELETE", f"{_API}/jobs/{job_id}")

    def tasks(self, job_id: str, *, status: str | None = None, limit: int | None = None) -> Iterator[Task]:
        """Yield the tasks of a job in order, at most `limit`."""
        params = {"status": status} if status else {}
        return _first(limit, self._paged(TaskPage, f"/jobs/{job_id}/tasks", params, limit))

    def log(self, job_id: str, task_id: str, *, attempt: int | None = None) -> str:
        """Return the log of a task's latest attempt, or of the one named."""
        params = {"attempt": str(attempt)} if attempt else {}
        return self._transport.ask("GET", f"{_API}/jobs/{job_id}/tasks/{task_id}/log", params=params).text

    def frames(self, job_id: str, *, limit: int | None = None) -> Iterator[Frame]:
        """Yield the frames of a job in order, at most `limit`."""
        return _first(limit, self._paged(FramePage, f"/jobs/{job_id}/frames", {}, limit))

    # What happens

    def events(self, job_id: str | None = None, *, last_id: str | None = None) -> Iterator[ServerEvent]:
        """Yield what happens to a job, or to all, for ever; a stream that breaks is taken up after the last event.

        The stream of one job begins with how it stands.
        """
        params = {"job": job_id} if job_id else {}
        return self._transport.events(f"{_API}/events", params=params, last_id=last_id)

    def follow(self, job_id: str) -> Iterator[Job]:
        """Yield a job whenever something about it changes, until it has ended."""
        job = self.job(job_id)
        yield job
        if job.status in ENDED_JOBS:
            return
        for event in self.events(job_id):
            message = _message(event)
            if isinstance(message, JobEvent) and isinstance(message.data, Job):
                job = message.data
            elif isinstance(message, ProgressEvent):
                job = job.model_copy(update=dict(message.data))
            else:
                continue
            yield job
            if job.status in ENDED_JOBS:
                return

    # Files

    def artifacts(self, job_id: str, *, prefix: str = "") -> Iterator[Artifact]:
        """Yield the files of a job whose names begin so, by name."""
        params = {"prefix": prefix} if prefix else {}
        return self._paged(ArtifactPage, f"/jobs/{job_id}/artifacts", params, None)

    def download(
        self,
        job_id: str,
        name: str,
        path: Path,
        *,
        format: Literal["png"] | None = None,  # noqa: A002 - the service's word
        bits: Literal[8, 16] = 8,
        on_bytes: Callable[[int], None] | None = None,
    ) -> Download:
        """Bring a file of a job to `path`, whole or not at all; `format="png"` turns a master into sRGB."""
        url = f"{_API}/jobs/{job_id}/artifacts/{name}"
        if format is None:
            return self._transport.download(url, path, on_bytes=on_bytes)
        params = {"format": format, "bits": str(bits)}
        return self._transport.download_made(url, path, params=params, on_bytes=on_bytes)

    # What can be seen of a frame

    def look(self, job_id: str, frame: int) -> Look:
        """Return which views a frame has."""
        return self._get(Look, f"/jobs/{job_id}/frames/{frame}/look")

    def see(self, job_id: str, frame: int, what: Sight, path: Path, **asked: str | float) -> Download:
        """Bring a picture that the service makes of a frame to `path`, whole or not at all.

        Parameters
        ----------
        what
            `view`, `perspective`, `refocus`, `observer`, `views.atlas`.
        asked
            Its parameters, by the service's names: `u=3, v=4`, `depth_mm=20`, `scale=4`, `format="webp"`.
        """
        url = f"{_API}/jobs/{job_id}/frames/{frame}/{what}"
        return self._transport.download_made(url, path, params={name: f"{one}" for name, one in asked.items()})

    # Scenes

    def scenes(self) -> Iterator[Scene]:
        """Yield the scenes that jobs can ask for, by name."""
        return self._paged(SceneList, "/scenes", {}, None)

    def scene(self, name: str) -> Scene:
        """Return a scene."""
        return self._get(Scene, f"/scenes/{name}")

    def upload_scene(self, name: str, bundle_zip: bytes) -> Scene:
        """Give the service a scene: a zip of scene.toml, the scene it names and what they use."""
        files = {"bundle": (f"{name}.zip", bundle_zip, "application/zip")}
        # The same content again is answered with the same scene, so it may arrive twice.
        answer = self._transport.ask("POST", f"{_API}/scenes", params={"name": name}, files=files, again=True)
        return _shaped(Scene, answer.json())

    # The farm

    def health(self) -> Health:
        """Return how the farm is."""
        return self._get(Health, "/health")

    def workers(self) -> WorkerList:
        """Return the workers that are there."""
        return self._get(WorkerList, "/workers")

    def keys(self) -> tuple[Key, ...]:
        """Return every key, without its secret."""
        return self._get(KeyList, "/keys").items

    def create_key(self, name: str, role: str) -> NewKey:
        """Make a key: `viewer`, `submitter` or `admin`; its secret is in this answer and nowhere else."""
        return _shaped(NewKey, self._transport.ask("POST", f"{_API}/keys", json={"name": name, "role": role}).json())

    def revoke_key(self, key_id: str) -> None:
        """Make a key useless, and the browser sessions that it opened."""
        self._transport.ask("DELETE", f"{_API}/keys/{key_id}")

    def login_link(self) -> LoginLink:
        """Return a link that logs a browser in, once and soon."""
        return _shaped(LoginLink, self._transport.ask("POST", f"{_API}/login-tokens").json())

    def _get(self, shape: type[Shape], path: str) -> Shape:
        return _shaped(shape, self._transport.ask("GET", _API + path).json())

    def _move(self, job_id: str, move: str) -> Job:
        return _shaped(Job, self._transport.ask("POST", f"{_API}/jobs/{job_id}/{move}").json())

    def _paged(self, page: type[BaseModel], path: str, params: Mapping[str, str], limit: int | None) -> Iterator[Any]:
        asked = dict(params) | {"limit": str(min(limit or _PAGE, _PAGE))}
        while True:
            answer: Any = _shaped(page, self._transport.ask("GET", _API + path, params=asked).json())
            yield from answer.items
            if answer.next_cursor is None:
                return
            asked["cursor"] = answer.next_cursor


def _first(limit: int | None, items: Iterator[Shape]) -> Iterator[Shape]:
    for count, item in enumerate(items):
        if count == limit:
            return
        yield item


def _shaped(shape: type[Shape], data: Any) -> Shape:
    # A newer service may say more than this client knows.
    return shape.model_validate(data, extra="ignore")


def _message(event: ServerEvent) -> StreamEvent | None:
    """Return an event by its schema; None for a kind of event that only a newer service knows."""
    if event.type not in set(EventTopic):
        return None
    return _shaped(StreamMessage, {"event": event.type, "data": event.data}).root
