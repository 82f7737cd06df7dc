"""The client against services that refuse requests for a while, and downloads that are ended while they wait."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from lippmann.client import Refused
from lippmann.client.transport import Transport
from lippmann.errors import Unreachable
from tests.integration.lippmann.test_transport import DATA, _file, _first, _Handler, _serving, _talking_to
from tests.waiting import ENOUGH_S

REASON = "expected at most 8 event streams of the key"
Download = Callable[[Transport, Path], object]
EITHER = pytest.mark.parametrize(
    "download",
    [
        pytest.param(lambda transport, path: transport.download("/file", path), id="stored"),
        pytest.param(lambda transport, path: transport.download_made("/file", path, params={}), id="made"),
    ],
)


def _too_many(handler: _Handler) -> None:
    handler.say(429, json.dumps({"detail": REASON, "code": "too-many-requests"}).encode())


def _one_event(handler: _Handler) -> None:
    seen = int(handler.headers.get("Last-Event-ID", "0"))
    handler.say(200, f"id: {seen + 1}\nevent: frame\ndata: {seen + 1}\n\n".encode(), Content_Type="text/event-stream")


def test_too_many_streams_of_a_key_are_refused_at_once_with_the_reason() -> None:
    with _serving(_too_many) as server, _talking_to(server) as transport:
        with pytest.raises(Refused, match=REASON):
            next(transport.events("/events", params={}))
        assert len(server.asked) == 1


def test_a_stream_that_is_taken_up_waits_for_the_broken_one_to_end() -> None:
    answers = iter([_one_event, _too_many, _too_many, _one_event])
    with _serving(lambda handler: next(answers)(handler)) as server, _talking_to(server) as transport:
        events = transport.events("/events", params={})
        assert [next(events).data for _ in range(2)] == [1, 2]
        events.close()  # type: ignore[attr-defined]


def test_a_stream_that_is_never_taken_up_again_ends_with_the_reason() -> None:
    full = _first(1, _one_event, then=_too_many)
    with _serving(full) as server, _talking_to(server, patience_s=0.3) as transport:
        events = transport.events("/events", params={})
        next(events)
        with pytest.raises(Refused, match=REASON):
            next(events)


@EITHER
def test_a_download_waits_while_there_are_too_many_requests(tmp_path: Path, download: Download) -> None:
    with _serving(_first(3, _too_many, then=_file(DATA))) as server, _talking_to(server) as transport:
        download(transport, tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == DATA


@EITHER
def test_a_download_without_patience_left_says_what_the_service_answered(tmp_path: Path, download: Download) -> None:
    with _serving(_too_many) as server, _talking_to(server, patience_s=0.3) as transport:
        with pytest.raises(Refused) as caught:
            download(transport, tmp_path / "file")
        assert len(server.asked) > 1
    assert caught.value.status == 429


def _repairing(handler: _Handler) -> None:
    handler.say(503, json.dumps({"detail": "the farm makes it again", "code": "artifact-repairing"}).encode())


@EITHER
@pytest.mark.parametrize("refused", [("GET",), ("HEAD", "GET")])
def test_a_file_that_is_being_made_again_is_named_as_that_when_patience_ends(
    tmp_path: Path, download: Download, refused: Sequence[str]
) -> None:
    def answer(handler: _Handler) -> None:
        commands.append(handler.command)
        (_repairing if handler.command in refused else _file(DATA))(handler)

    commands = list[str]()
    with (
        _serving(answer) as server,
        _talking_to(server, patience_s=0.3) as transport,
        pytest.raises(Refused, match="the farm makes it again") as caught,
    ):
        download(transport, tmp_path / "file")
    assert commands.count(next(name for name in refused if name in commands)) > 1
    assert (caught.value.status, caught.value.code) == (503, "artifact-repairing")


@EITHER
def test_a_file_comes_once_it_is_made_again(tmp_path: Path, download: Download) -> None:
    with _serving(_first(3, _repairing, then=_file(DATA))) as server, _talking_to(server) as transport:
        download(transport, tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == DATA


def test_a_file_that_is_being_made_again_is_not_waited_for_if_the_caller_does_not_want_it(tmp_path: Path) -> None:
    slept = list[float]()
    with _serving(_repairing) as server, _talking_to(server, patience_s=ENOUGH_S) as transport:
        with pytest.raises(Refused) as caught:
            transport.download("/file", tmp_path / "file", sleep=slept.append, waits_for_repair=lambda: False)
        with pytest.raises(Refused):
            transport.download_made(
                "/file", tmp_path / "file", params={}, sleep=slept.append, waits_for_repair=lambda: False
            )
    assert (caught.value.code, slept) == ("artifact-repairing", [])


@EITHER
@pytest.mark.parametrize("says", [("GET",), ("HEAD", "GET")])
def test_a_proxy_without_a_service_is_no_answer_of_the_service(
    tmp_path: Path, download: Download, says: Sequence[str]
) -> None:
    def answer(handler: _Handler) -> None:
        if handler.command in says:
            handler.say(502, b"" if handler.command == "HEAD" else b"<html>Bad gateway</html>")
        else:
            _file(DATA)(handler)

    with (
        _serving(answer) as server,
        _talking_to(server, patience_s=0.3) as transport,
        pytest.raises(Unreachable, match=r"expected a service at .*, got: the service answered 502"),
    ):
        download(transport, tmp_path / "file")


@pytest.mark.parametrize("refused", ["HEAD", "GET"])
def test_a_download_is_ended_between_two_attempts(tmp_path: Path, refused: str) -> None:
    def answer(handler: _Handler) -> None:
        (_too_many if handler.command == refused else _file(DATA))(handler)

    def ended(_: float) -> None:
        raise InterruptedError

    with _serving(answer) as server, _talking_to(server) as transport:
        with pytest.raises(InterruptedError):
            transport.download("/file", tmp_path / "file", sleep=ended)
        if refused == "GET":
            with pytest.raises(InterruptedError):
                transport.download_made("/file", tmp_path / "file", params={}, sleep=ended)
