"""The client against services that break off, hang up and refuse."""

from __future__ import annotations

import hashlib
import json
import threading
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from lippmann.cli.exit_codes import ExitCode, exit_code_of
from lippmann.client import Client, Refused
from lippmann.client.address import Address
from lippmann.client.transport import Transport
from lippmann.errors import BadInput, JobEnded, Unreachable
from service.events.hub import RESET
from service.events.publish import job_snapshot
from service.events.sse import encode
from service.schemas.events import JobRemoved
from tests.builders_service import Farm as ServiceFarm
from tests.waiting import ENOUGH_S

Answer = Callable[["_Handler"], None]
DATA = bytes(range(256)) * 400


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: _Server

    def handle_any(self) -> None:
        length = int(self.headers.get("Content-Length") or 0)
        self.body = self.rfile.read(length)
        self.server.asked.append((self.command, dict(self.headers), self.body))
        self.server.answer(self)

    do_GET = do_HEAD = do_POST = do_DELETE = handle_any  # noqa: N815 - the library's names

    def say(self, status: int, data: bytes = b"", **headers: str) -> None:
        self.send_response(status)
        for name, value in ({"Content-Length": str(len(data))} | headers).items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    def hang_up(self) -> None:
        self.close_connection = True
        self.connection.shutdown(2)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, answer: Answer) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer = answer
        self.asked: list[tuple[str, dict[str, str], bytes]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def handle_error(self, *_: object) -> None:
        """Say nothing: connections that break are what is tested."""


@contextmanager
def _serving(answer: Answer) -> Iterator[_Server]:
    with _Server(answer) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def _talking_to(server: _Server, *, patience_s: float = ENOUGH_S) -> Iterator[Transport]:
    transport = Transport(Address(server.url, "lip_a_b"), patience_s=patience_s, sleep=lambda _: None)
    try:
        yield transport
    finally:
        transport.close()


@pytest.mark.parametrize(
    ("kind", "data", "got"),
    [
        ("text/html; charset=utf-8", b"<html>", "got one of text/html"),
        ("application/json", b"{", "got one of application/json"),
        ("application/json", b"[]", "got one with another 'content'"),
        ("application/json", b'{"name": "x"}', "got one without "),
        ("application/json", b'{"id": 7, "items": 7}', "got one with another "),
    ],
)
def test_a_url_of_something_else_is_named_with_what_answered(kind: str, data: bytes, got: str) -> None:
    calls: tuple[Callable[[Client], object], ...] = (
        lambda client: list(client.jobs()),
        lambda client: client.job("one"),
        lambda client: client.submit({"scene": "fish"}),
        lambda client: client.delete("one"),
    )
    with _serving(lambda request: request.say(200, data, Content_Type=kind)) as server:
        for call in calls:
            with (
                Client(server.url, "lip_a_b") as client,
                pytest.raises(Unreachable, match="a Lippmann service") as said,
            ):
                call(client)
            assert server.url in said.value.message
            assert got in said.value.message or said.value.message.endswith("got 200")
            assert exit_code_of(said.value) is ExitCode.UNREACHABLE


def test_a_refused_download_has_the_reason_that_head_cannot_have(tmp_path: Path) -> None:
    problem = json.dumps({"detail": "there is no file 'a.png'", "code": "not-found"}).encode()
    with (
        _serving(lambda request: request.say(404, problem)) as server,
        _talking_to(server) as transport,
        pytest.raises(Refused, match=r"there is no file 'a\.png'") as refused,
    ):
        transport.download("/file", tmp_path / "a.png")
    assert (refused.value.status, refused.value.code) == (404, "not-found")


@pytest.mark.parametrize("job", ["fish", {"fps": float("nan")}, {"scene": object()}])
def test_what_is_no_job_is_refused_before_it_is_sent(job: object) -> None:
    with Client("http://127.0.0.1:1", "lip_a_b") as client, pytest.raises(BadInput, match="expected a job"):
        client.submit(job)  # type: ignore[arg-type]  # it is what is tested


@pytest.mark.parametrize("breaks", [0, 1, 5])
def test_a_download_goes_on_where_it_broke_off_and_comes_whole(tmp_path: Path, breaks: int) -> None:
    with _serving(_file(DATA, breaks=breaks)) as server:
        came: list[int] = []
        with _talking_to(server) as transport:
            download = transport.download("/file", tmp_path / "a" / "file", on_bytes=came.append)
    assert download.path.read_bytes() == DATA
    assert (download.size, download.etag, sum(came)) == (len(DATA), '"one"', len(DATA))
    starts = [int(headers.get("Range", "bytes=0-")[6:-1]) for method, headers, _ in server.asked if method == "GET"]
    assert len(starts) == breaks + 1
    assert starts == sorted(set(starts))
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["file"]


def test_a_download_that_another_run_left_goes_on(tmp_path: Path) -> None:
    _break_off(tmp_path / "file")
    (part,) = tmp_path.iterdir()
    here = part.stat().st_size
    assert not (tmp_path / "file").exists()
    with _serving(_file(DATA)) as server, _talking_to(server) as transport:
        came: list[int] = []
        transport.download("/file", tmp_path / "file", on_bytes=came.append)
    assert (tmp_path / "file").read_bytes() == DATA
    assert sum(came) == len(DATA) - here < len(DATA)


def test_halves_of_two_files_never_meet(tmp_path: Path) -> None:
    _break_off(tmp_path / "file")
    other = bytes(reversed(DATA))
    with _serving(_file(other, etag='"two"')) as server, _talking_to(server) as transport:
        transport.download("/file", tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == other


def test_a_file_that_is_here_whole_but_was_not_renamed_is_not_brought_again(tmp_path: Path) -> None:
    with _serving(_file(DATA)) as server, _talking_to(server) as transport:
        download = transport.download("/file", tmp_path / "file")
        download.path.rename(_part_of(tmp_path / "file"))
        came: list[int] = []
        transport.download("/file", tmp_path / "file", on_bytes=came.append)
    assert (tmp_path / "file").read_bytes() == DATA
    assert came == []


def test_a_file_that_is_damaged_on_the_service_is_never_kept_as_a_whole_one(tmp_path: Path) -> None:
    """A service keeps the end of a large damaged file back, but sends it to whoever asks for the rest."""
    damaged = DATA[:-1] + b"?"
    with (
        _serving(_file(damaged, breaks=1, digest_of=DATA)) as server,
        _talking_to(server) as transport,
        pytest.raises(Refused, match=r"file: expected the SHA-256 \w+, got another one; the action `repair`") as caught,
    ):
        transport.download("/file", tmp_path / "file")
    assert caught.value.code == "artifact-broken"
    assert list(tmp_path.iterdir()) == []


def test_what_is_here_and_damaged_is_replaced(tmp_path: Path) -> None:
    part = _part_of(tmp_path / "file")
    part.write_bytes(b"?" * (len(DATA) // 2))
    with _serving(_file(DATA, digest_of=DATA)) as server, _talking_to(server) as transport:
        transport._store_server.is_reachable = False  # so the service sends the file
        transport.download("/file", tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == DATA


def test_what_is_here_and_longer_than_the_file_is_no_part_of_it(tmp_path: Path) -> None:
    part = _part_of(tmp_path / "file")
    part.write_bytes(DATA + b"?")
    with _serving(_file(DATA)) as server, _talking_to(server) as transport:
        transport.download("/file", tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == DATA
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_picture_that_is_made_when_asked_for_comes_from_the_start_each_time(tmp_path: Path) -> None:
    with _serving(_file(DATA, breaks=2)) as server, _talking_to(server) as transport:
        transport.download_made("/file", tmp_path / "file", params={"format": "png"})
    assert (tmp_path / "file").read_bytes() == DATA
    assert [(method, "Range" in headers) for method, headers, _ in server.asked] == [("GET", False)] * 3


def test_a_file_that_is_not_there_leaves_nothing(tmp_path: Path) -> None:
    missing: Answer = lambda handler: handler.say(404)  # noqa: E731
    with _serving(missing) as server, _talking_to(server) as transport, pytest.raises(Refused) as caught:
        transport.download("/file", tmp_path / "file")
    assert caught.value.status == 404
    assert list(tmp_path.iterdir()) == []


def test_a_job_is_sent_again_with_the_same_key_when_the_connection_breaks() -> None:
    with _serving(_first(2, _Handler.hang_up, then=lambda handler: handler.say(422))) as server:
        client = Client(server.url, "k", patience_s=ENOUGH_S)
        with client, pytest.raises(Refused):
            client.submit({"scene": "fish"})
    keys = [headers["Idempotency-Key"] for _, headers, _ in server.asked]
    assert len(keys) == 3
    assert len(set(keys)) == 1


def test_a_move_that_may_have_arrived_is_not_sent_again() -> None:
    with _serving(_Handler.hang_up) as server, Client(server.url, "k") as client:
        with pytest.raises(Unreachable):
            client.cancel("a")
        assert len(server.asked) == 1


@pytest.mark.parametrize("lost", [_Handler.hang_up, lambda handler: handler.say(502)], ids=["broken", "proxy"])
def test_a_removal_whose_answer_is_lost_is_done_when_there_is_nothing_to_remove(lost: Answer) -> None:
    problem = json.dumps({"detail": "there is no job", "code": "not-found"}).encode()
    gone: Answer = lambda handler: handler.say(404, problem)  # noqa: E731
    with _serving(_first(1, lost, then=gone)) as server, Client(server.url, "k", patience_s=ENOUGH_S) as client:
        client.delete("one")
        assert [method for method, _, _ in server.asked] == ["DELETE"] * 2
        with pytest.raises(Refused, match="there is no job"):
            client.delete("two")


def test_a_proxy_that_knows_no_service_has_not_removed_anything() -> None:
    nowhere: Answer = lambda handler: handler.say(404, b"<html>no such site</html>")  # noqa: E731
    lost = _first(1, _Handler.hang_up, then=nowhere)
    with _serving(lost) as server, Client(server.url, "k", patience_s=ENOUGH_S) as client:
        with pytest.raises(Refused) as caught:
            client.delete("one")
        assert (caught.value.status, len(server.asked)) == (404, 2)


@pytest.mark.parametrize("removes", [True, False])
def test_what_was_not_removed_is_missing_as_before(removes: bool) -> None:
    """A busy service has removed nothing, and a job that is read anew may not be gone."""
    busy: Answer = lambda handler: handler.say(503) if removes else handler.hang_up()  # noqa: E731
    gone: Answer = lambda handler: handler.say(404)  # noqa: E731
    with _serving(_first(1, busy, then=gone)) as server, Client(server.url, "k", patience_s=ENOUGH_S) as client:
        with pytest.raises(Refused) as caught:
            (client.delete if removes else client.job)("one")
        assert (caught.value.status, len(server.asked)) == (404, 2)


def test_a_service_that_is_busy_is_asked_again_until_patience_ends() -> None:
    busy = _first(2, lambda handler: handler.say(503), then=lambda handler: handler.say(200, b"{}"))
    with _serving(busy) as server, _talking_to(server) as transport:
        assert transport.request("GET", "/").json() == {}
    with _serving(lambda handler: handler.say(503)) as server, _talking_to(server, patience_s=0.0) as transport:
        with pytest.raises(Refused) as caught:
            transport.request("GET", "/")
        assert (caught.value.status, len(server.asked)) == (503, 1)


def test_a_refusal_names_the_fields_and_the_exit_code() -> None:
    problem = {"detail": "no", "code": "spec", "request_id": "r1",
               "errors": [{"field": "frames", "expected": "a", "got": "b"}]}  # fmt: skip
    refuse: Answer = lambda handler: handler.say(422, json.dumps(problem).encode())  # noqa: E731
    with _serving(refuse) as server, _talking_to(server) as transport, pytest.raises(Refused) as caught:
        transport.request("GET", "/")
    assert str(caught.value.problems[0]) == "frames: expected a, got b"
    assert (caught.value.request_id, exit_code_of(caught.value)) == ("r1", ExitCode.BAD_INPUT)


def test_a_stream_that_breaks_is_taken_up_after_the_last_event() -> None:
    def answer(handler: _Handler) -> None:
        seen = int(handler.headers.get("Last-Event-ID", "0"))
        handler.send_response(200)
        handler.send_header("Content-Type", "text/event-stream")
        handler.end_headers()
        handler.wfile.write(f"id: {seen + 1}\nevent: frame\ndata: {seen + 1}\n\nid: 99\ndata: half".encode())
        handler.wfile.flush()
        handler.hang_up()

    with _serving(answer) as server, _talking_to(server) as transport:
        events = transport.events("/events", params={"job": "a"})
        assert [next(events).data for _ in range(4)] == [1, 2, 3, 4]
        events.close()  # type: ignore[attr-defined]


@pytest.mark.parametrize("is_told", [True, False])
def test_a_job_that_is_removed_while_it_is_followed_ends_the_following(tmp_path: Path, is_told: bool) -> None:
    """A client that was away for long has missed the removal, and reads the job anew after a reset."""
    service = ServiceFarm(f"sqlite:///{tmp_path / 'service.db'}")
    job_id = service.submit()
    with service.database.reading() as session:
        job = job_snapshot(session, service.job(job_id)).model_dump(mode="json")
    service.database.dispose()
    removal = JobRemoved(id=job_id, removed=True).model_dump(mode="json")

    second = ("job", removal) if is_told else ("reset", RESET.model_dump())
    asked: list[str] = []

    def answer(handler: _Handler) -> None:
        if "/events" not in handler.path:
            asked.append(handler.path)
            handler.say(200 if len(asked) == 1 else 404, json.dumps(job).encode())
            return
        events = (
            encode(number, topic, json.dumps(data))
            for number, (topic, data) in enumerate((("job", job), second), start=1)
        )
        handler.say(200, b"".join(events), Content_Type="text/event-stream")

    with _serving(answer) as server, Client(server.url, "k") as client:
        following = client.follow(job_id)
        assert [next(following).id for _ in range(2)] == [job_id] * 2
        with pytest.raises(JobEnded, match=f"job {job_id} was removed"):
            next(following)


def test_a_stream_of_a_service_that_is_gone_ends_when_patience_does() -> None:
    with _serving(_Handler.hang_up) as server:
        url = server.url
        with _talking_to(server, patience_s=0.2) as transport, pytest.raises(Unreachable, match=f"a service at {url}"):
            next(transport.events("/events", params={}))


@pytest.mark.parametrize("patience_s", [0.0, 0.05, 0.3])
def test_a_stream_that_ended_in_order_and_does_not_come_back_ends_with_the_reason(patience_s: float) -> None:
    stream = b"id: 1\nevent: frame\ndata: 1\n\n"
    once = _first(1, lambda handler: handler.say(200, stream, Content_Type="text/event-stream"), then=_Handler.hang_up)
    with _serving(once) as server, _talking_to(server, patience_s=patience_s) as transport:
        events = transport.events("/events", params={})
        assert next(events).data == 1
        with pytest.raises(Unreachable, match="expected a service at"):
            next(events)


@pytest.mark.parametrize(("url", "key"), [("http://[::1", "k"), ("http://127.0.0.1", "schlüssel\n")])
def test_a_url_or_key_that_cannot_be_is_refused(url: str, key: str) -> None:
    with pytest.raises(BadInput, match="expected a URL and a key"):
        Transport(Address(url, key))


def _file(
    data: bytes, *, breaks: int = 0, etag: str = '"one"', share: int = 10, digest_of: bytes | None = None
) -> Answer:
    """Serve a file with ranges; the first answers break off after a part of what was asked for.

    The service tells the digest of `digest_of`; none by default.
    """
    left = [breaks]
    digest = "" if digest_of is None else b64encode(hashlib.sha256(digest_of).digest()).decode()

    def answer(handler: _Handler) -> None:
        asked = handler.headers.get("Range")
        fresh = handler.headers.get("If-Range") in (None, etag)
        start = int(asked[6:-1]) if asked and fresh else 0
        if asked and start >= len(data):
            handler.say(416, Content_Range=f"bytes */{len(data)}")
            return
        rest = data[start:]
        handler.send_response(206 if asked and fresh else 200)
        handler.send_header("ETag", etag)
        if digest:
            handler.send_header("Repr-Digest", f"sha-256=:{digest}:")
        handler.send_header("Content-Length", str(len(rest)))
        handler.end_headers()
        if handler.command == "HEAD":
            return
        if left[0] > 0:
            left[0] -= 1
            handler.wfile.write(rest[: len(rest) // share])
            handler.hang_up()
        else:
            handler.wfile.write(rest)

    return answer


def _first(count: int, answer: Answer, *, then: Answer) -> Answer:
    left = [count]

    def both(handler: _Handler) -> None:
        left[0] -= 1
        (answer if left[0] >= 0 else then)(handler)

    return both


def _break_off(path: Path) -> None:
    """Begin to download the file, and be cut off for good after a third."""
    with _serving(_file(DATA, breaks=10**6, share=3)) as server, _talking_to(server, patience_s=0.0) as transport:
        try:
            transport.download("/file", path)
        except Unreachable:
            return
    raise AssertionError("it was not cut off")


def _part_of(path: Path) -> Path:
    """Return where the part of a download to `path` lies."""
    _break_off(path)
    (part,) = path.parent.glob(f".{path.name}.*.part")
    part.unlink()
    return part
