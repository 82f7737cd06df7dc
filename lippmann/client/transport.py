"""HTTP: keys, retries, problem details, and downloads that resume. Besides, `direct` and `http_client` import httpx.

| answer | what we do |
|---|---|
| no connection | retry with pauses until `patience_s` is over, then `Unreachable` |
| connection lost after sending, 502, 503, 504 | retry if the request may be repeated, else `Unreachable` |
| 502, 503, 504 to a download or a stream | the same; then `Refused` if the service says why |
| 404 to a DELETE that is sent again after its answer was lost | it is done |
| 429 to a download, or to a stream that is taken up again | retry with pauses, then `Refused` |
| 401, 403 | `KeyRefused` |
| other 4xx, 5xx | `Refused` with the invalid fields |
| 206 | append the rest of a download |
| 200 to a request for the rest | the file changed, or ranges are not served: download from the start |
| 416 to a request for the rest | the file is here whole; if what is here is longer, download from the start |
| 307 to a download | download from the server of the store; see `direct` |
| a download whose digest is not the one that the service told | `Refused` |
"""

from __future__ import annotations

import hashlib
import itertools
import os
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Any

import httpx

from lippmann.client.address import Address
from lippmann.client.direct import ASKS, NotDirect, StoreServer, expected_sha256
from lippmann.client.errors import Refused, refusal
from lippmann.client.http_client import new_http_client
from lippmann.client.partial_file import OnBytes, append, sha256_of, size_of, write
from lippmann.client.stream import ServerEvent, parse_events
from lippmann.errors import ArtifactBroken, BadInput, LippmannError, Unreachable
from service.errors import ArtifactRepairing, NotFound

PATIENCE_S = 3.0
"""The time for which the client retries a service that does not answer, s."""
SILENCE_S = 45.0
"""A stream that is silent for longer, s, is opened again; the service sends a comment every 15 s."""

_BUSY = frozenset({502, 503, 504})
_LOST = frozenset({502, 504})
"""The statuses with which a proxy answers that may have sent a request and has no answer."""
_TOO_MANY = 429
_BUSY_OR_TOO_MANY = _BUSY | {_TOO_MANY}
Response = httpx.Response
Sleep = Callable[[float], None]


class _NotNow(httpx.HTTPError):
    """The service refused a request that is repeated."""

    def __init__(self, refused: Refused) -> None:
        super().__init__(f"the service answered {refused.status}")
        self.refused = refused


@dataclass(frozen=True)
class Download:
    """A downloaded file."""

    path: Path
    size: int
    etag: str
    """The entity tag of the file, with its quotes."""


class Transport:
    """A connection pool to one service."""

    def __init__(self, address: Address, *, patience_s: float = PATIENCE_S, sleep: Sleep = time.sleep) -> None:
        self.url = address.url.rstrip("/")
        self._patience_s = patience_s
        self._sleep = sleep
        self._store_server = StoreServer(needs_https=self.url.startswith("https://"))
        try:
            self._http = new_http_client(
                self.url,
                base_url=self.url,
                headers={"Authorization": f"Bearer {address.key}"} if address.key else {},
                timeout=httpx.Timeout(30.0, connect=5.0),
            )
        except (httpx.InvalidURL, UnicodeEncodeError) as error:
            raise BadInput(f"expected a URL and a key of plain letters, got {address.url!r}: {error}") from error

    def close(self) -> None:
        """Close every connection."""
        self._http.close()
        self._store_server.close()

    def request(self, method: str, path: str, *, repeatable: bool | None = None, **parts: Any) -> httpx.Response:
        """Send a request and return the response.

        The response is no error, but for the 404 to a DELETE that was sent again because its answer was lost: what it
        removes is gone.

        Parameters
        ----------
        repeatable
            Whether the request may be repeated. The default is true for every method but POST.
        parts
            The arguments of `httpx.Client.request`.
        """
        may_repeat = method != "POST" if repeatable is None else repeatable
        return self._request(method, path, repeated=_BUSY if may_repeat else frozenset(), sleep=self._sleep, **parts)

    def _request(
        self, method: str, path: str, *, repeated: Collection[int], sleep: Sleep, **parts: Any
    ) -> httpx.Response:
        """Send a request, again after the `repeated` statuses; without any, it is sent at most once."""
        may_have_arrived = False
        for pause_s in self._pauses():
            try:
                with _utf8_only():
                    response = self._http.request(method, path, **parts)
            except httpx.HTTPError as error:
                is_sent = not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout)
                if pause_s is None or (is_sent and not repeated):
                    raise self._unreachable(error) from error
                may_have_arrived |= is_sent
            else:
                if method == "DELETE" and may_have_arrived and _is_gone(response):
                    return response
                if pause_s is None or response.status_code not in repeated:
                    return _checked(response)
                may_have_arrived |= response.status_code in _LOST
            sleep(pause_s)
        raise AssertionError("the last pause is None")

    def events(self, path: str, *, params: Mapping[str, str], last_id: str | None = None) -> Iterator[ServerEvent]:
        """Yield the events of the service without end; a broken stream is resumed after the last event.

        A service that has too many streams of the key refuses the first request at once. Later on, one of them may be
        the broken stream itself.
        """
        pauses, repeated = self._pauses(), _BUSY
        while True:
            headers = {"Accept": "text/event-stream"} | ({"Last-Event-ID": last_id} if last_id else {})
            try:
                timeout = httpx.Timeout(30.0, connect=5.0, read=SILENCE_S)
                with self._streamed(
                    path, repeated=repeated, params=params, headers=headers, timeout=timeout
                ) as response:
                    pauses, repeated = self._pauses(), _BUSY_OR_TOO_MANY
                    for event in parse_events(response.iter_lines()):
                        last_id = event.id or last_id
                        yield event
            except httpx.HTTPError as error:
                pause_s = next(pauses)
                if pause_s is None:
                    raise self._given_up(error) from error
                self._sleep(pause_s)
            else:
                self._sleep(next(pauses) or 0.0)  # The stream ended in order, as when the service stops; connect again.

    def download(
        self,
        path: str,
        target: Path,
        *,
        on_bytes: OnBytes | None = None,
        sleep: Sleep | None = None,
        waits_for_repair: Callable[[], bool] = lambda: True,
    ) -> Download:
        """Download a file under a temporary name and rename it; an interrupted download resumes.

        The temporary name contains the entity tag, so that parts of two versions are never joined. A file whose digest
        is known comes from the server of the store, where the service has one that can be reached.

        Parameters
        ----------
        sleep
            Waits between the attempts, and may raise to end the download.
        waits_for_repair
            Returns whether the download waits for a file that the farm makes again, for `patience_s` at most.

        Raises
        ------
        Refused
            If the service refuses, or the digest of what came is not the one that the service told. The service
            verifies no part of a large file, so a damaged file may come in two parts.
        """
        sleep = sleep or self._sleep
        head = self._head(path, sleep=sleep, waits_for_repair=waits_for_repair)
        etag, sha256 = _etag(head), expected_sha256(head.headers)
        part = target.with_name(f".{target.name}.{hashlib.sha256(etag.encode()).hexdigest()[:12]}.part")
        part.parent.mkdir(parents=True, exist_ok=True)
        if sha256 and etag and self._append_directly(path, part, etag=etag, sha256=sha256, on_bytes=on_bytes):
            return _finished(part, target, etag)
        # What was here may be the damage, so the file is downloaded from the start before the farm is blamed.
        for _ in range(2):
            came = self._retried(
                part, lambda: self._append(path, part, etag=etag, on_bytes=on_bytes), sleep, waits_for_repair
            )
            if not sha256 or came != etag or sha256_of(part) == sha256:
                return _finished(part, target, came)
            part.unlink()
        raise _broken(target, sha256)

    def _head(self, path: str, *, sleep: Sleep, waits_for_repair: Callable[[], bool]) -> httpx.Response:
        """Return the headers of a file.

        Raises
        ------
        Refused, Unreachable
            As the answer to a download of the file says, since the one to HEAD has no details.
        """
        repeated = _BUSY_OR_TOO_MANY if waits_for_repair() else _BUSY_OR_TOO_MANY - {HTTPStatus.SERVICE_UNAVAILABLE}
        try:
            return self._request("HEAD", path, repeated=repeated, sleep=sleep)
        except Refused:
            try:
                with self._streamed(path, repeated=_BUSY):
                    pass  # By now the service sends the file.
            except httpx.HTTPError as error:
                raise self._given_up(error) from error
            return self._request("HEAD", path, repeated=_BUSY_OR_TOO_MANY, sleep=sleep)

    def download_made(
        self,
        path: str,
        target: Path,
        *,
        params: Mapping[str, str],
        on_bytes: OnBytes | None = None,
        sleep: Sleep | None = None,
        waits_for_repair: Callable[[], bool] = lambda: True,
    ) -> Download:
        """Download a file that the service makes on demand, always from the start; the rest is as in `download`."""
        part = target.with_name(f".{target.name}.{os.getpid()}.part")
        part.parent.mkdir(parents=True, exist_ok=True)
        etag = self._retried(
            part,
            lambda: self._write(path, part, params=params, on_bytes=on_bytes),
            sleep or self._sleep,
            waits_for_repair,
        )
        return _finished(part, target, etag)

    def _retried(
        self,
        part: Path,
        download: Callable[[], str],
        sleep: Sleep,
        waits_for_repair: Callable[[], bool],
    ) -> str:
        pauses, here = self._pauses(), -1
        while True:
            try:
                return download()
            except httpx.HTTPError as error:
                grown = size_of(part)
                if grown > here:  # Data arrived, so the time limit starts again.
                    pauses, here = self._pauses(), grown
                pause_s = next(pauses)
                if pause_s is None or (_is_repairing(error) and not waits_for_repair()):
                    raise self._given_up(error) from error
                sleep(pause_s)

    def _append(self, path: str, part: Path, *, etag: str, on_bytes: OnBytes | None, is_direct: bool = False) -> str:
        try:
            return self._append_rest(path, part, etag=etag, on_bytes=on_bytes, is_direct=is_direct)
        except Refused as error:
            if error.status != HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:
                raise
        part.unlink(missing_ok=True)  # It is longer than the file, so it is no part of it.
        return self._append_rest(path, part, etag=etag, on_bytes=on_bytes, is_direct=is_direct)

    def _append_rest(self, path: str, part: Path, *, etag: str, on_bytes: OnBytes | None, is_direct: bool) -> str:
        here = size_of(part) if etag else 0
        headers = {"Range": f"bytes={here}-", "If-Range": etag} if here else {}
        if is_direct:
            headers |= ASKS
        with self._streamed(path, headers=headers, whole_at=here, may_redirect=is_direct) as response:
            if not response.is_redirect:
                append(part, response, on_bytes)
                return etag if response.status_code != 200 else _etag(response)
            url = response.headers.get("Location", "")
        with self._store_server.streamed(url, start=here, etag=etag) as response:
            append(part, response, on_bytes)
        return etag

    def _append_directly(self, path: str, part: Path, *, etag: str, sha256: str, on_bytes: OnBytes | None) -> bool:
        """Download a file from the server of the store, and return whether it is whole.

        Otherwise, the service sends the rest; of a file whose digest is another one, it sends everything.
        """
        while self._store_server.is_reachable:
            here = size_of(part)
            try:
                self._append(path, part, etag=etag, on_bytes=on_bytes, is_direct=True)
            except NotDirect:
                return False
            except httpx.HTTPError:
                if size_of(part) == here:
                    return False
                continue
            if sha256_of(part) == sha256:
                return True
            part.unlink()
            return False
        return False

    def _write(self, path: str, part: Path, *, params: Mapping[str, str], on_bytes: OnBytes | None) -> str:
        with self._streamed(path, params=params) as response:
            write(part, response, on_bytes)
            return _etag(response)

    @contextmanager
    def _streamed(
        self, path: str, *, whole_at: int = 0, repeated: Collection[int] = _BUSY_OR_TOO_MANY,
        may_redirect: bool = False, **parts: Any,
    ) -> Iterator[httpx.Response]:  # fmt: skip
        """Open a stream; the errors of the HTTP library that it raises are those after which it is tried again."""
        with _utf8_only(), self._http.stream("GET", path, **parts) as response:
            if response.status_code in repeated:
                response.read()
                raise _NotNow(_refusal(response))
            if response.is_error and not (response.status_code == 416 and _is_whole(response, whole_at)):
                response.read()
                _checked(response)
            if response.is_redirect and not may_redirect:
                _checked(response)
            yield response

    def _pauses(self) -> Iterator[float | None]:
        """Yield the pauses between attempts, and None for ever when `patience_s` is over."""
        until = time.monotonic() + self._patience_s
        for attempt in itertools.count():
            pause_s = min(0.1 * 2**attempt, 2.0)
            if time.monotonic() + pause_s > until:
                break
            yield pause_s
        yield from itertools.repeat(None)

    def _given_up(self, error: httpx.HTTPError) -> LippmannError:
        """Return the error to raise when patience is over: what the service answered, if it is there.

        Without a code, the answer is that of a proxy, whose service is not there.
        """
        if isinstance(error, _NotNow) and (error.refused.code or error.refused.status == _TOO_MANY):
            return error.refused
        return self._unreachable(error)

    def _unreachable(self, error: Exception) -> Unreachable:
        return Unreachable(f"expected a service at {self.url}, got: {str(error) or type(error).__name__}")


@contextmanager
def _utf8_only() -> Iterator[None]:
    """Refuse a request with text that is not UTF-8, such as a name from a command line in another encoding."""
    try:
        yield
    except UnicodeEncodeError as error:
        got = ascii(error.object[max(0, error.start - 20) : error.end + 20])
        raise BadInput(f"expected names, ids and titles in UTF-8, got {got}") from error


def _finished(part: Path, target: Path, etag: str) -> Download:
    part.replace(target)
    return Download(path=target, size=target.stat().st_size, etag=etag)


def _broken(target: Path, sha256: str | None) -> Refused:
    got = "got another one; the action `repair` of the job makes it again"
    message = f"{target.name}: expected the SHA-256 {sha256}, {got}"
    return Refused(message, status=HTTPStatus.INTERNAL_SERVER_ERROR, code=ArtifactBroken.code)


def _is_repairing(error: httpx.HTTPError) -> bool:
    return isinstance(error, _NotNow) and error.refused.code == ArtifactRepairing.code


def _is_gone(response: httpx.Response) -> bool:
    """Return whether the service, and not a proxy in front of it, says that something does not exist."""
    return response.status_code == HTTPStatus.NOT_FOUND and _refusal(response).code == NotFound.code


def _etag(response: httpx.Response) -> str:
    return str(response.headers.get("ETag", ""))


def _is_whole(response: httpx.Response, size: int) -> bool:
    return str(response.headers.get("Content-Range", "")).endswith(f"/{size}")


def _checked(response: httpx.Response) -> httpx.Response:
    if response.is_error:
        raise _refusal(response)
    if response.is_redirect:
        raise LippmannError(f"expected a response of the service, got a redirect to {response.headers.get('Location')}")
    return response


def _refusal(response: httpx.Response) -> Refused:
    try:
        problem = response.json()
    except ValueError:
        problem = None
    return refusal(response.status_code, response.reason_phrase, problem)
