"""Webhooks from the end of a job to a real receiver: what it gets, how often, and what it cannot do to the farm."""

from __future__ import annotations

import json
import os
import re
import socket
import threading
import time
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.states import JobStatus
from service.auth import Caller
from service.db import webhooks as rows
from service.db.tables import ADMIN_OWNER, JobEvent, WebhookDelivery
from service.jobs.commands import cancel_job, remove_job, retry_job
from service.jobs.submission import submit_job
from service.schemas.access import Role
from service.webhooks import sender as module
from service.webhooks.sender import WebhookSender
from service.webhooks.signature import secret_of
from tests.authority import Authority
from tests.builders_service import CALLER, SPEC, Farm, claimed, failed
from tests.postgresql import DATABASES
from tests.receiver import Received, Receiver, receiving
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

PAUSE_S = 10.0


@pytest.fixture
def hooks(make_farm: Callable[..., Farm]) -> Farm:
    """Return a farm that sends to this machine."""
    return hooked(make_farm)


def hooked(make_farm: Callable[..., Farm], **settings: Any) -> Farm:
    farm = make_farm(**({"webhook_hosts": "127.0.0.1", "webhook_http": True, "webhook_pause_s": PAUSE_S} | settings))
    farm.settings.link_keys.ensure()
    return farm


def sender_of(farm: Farm) -> WebhookSender:
    return WebhookSender(farm.database, farm.settings, is_active=lambda: True, clock=lambda: farm.now_s)


def submit(farm: Farm, url: str, *, caller: Caller = CALLER) -> str:
    job, _ = submit_job(
        farm.database, farm.parts, caller, SPEC, idempotency_key=None, now_s=farm.now_s, settings=farm.settings,
        webhook=url,
    )  # fmt: skip
    return job.id


def cancelled(farm: Farm, url: str, **more: Any) -> str:
    """Return a job that was cancelled, which is a quick end."""
    job_id = submit(farm, url, **more)
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    return job_id


def pending(farm: Farm) -> list[WebhookDelivery]:
    with farm.database.reading() as session:
        return session.query(WebhookDelivery).order_by(WebhookDelivery.id).all()


def is_genuine(secret: str, received: Received, *, now_s: float, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Verify a message with the lines of the documentation."""
    page = (ROOT / "docs/webhooks.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict[str, Any] = {}
    exec(lines, names)
    monkeypatch.setattr(time, "time", lambda: now_s)
    verify: Callable[[str, Mapping[str, str], bytes], bool] = names["is_genuine"]
    try:
        return verify(secret, received.headers, received.body)
    finally:
        monkeypatch.undo()


@pytest.mark.promise("People", "A receiver can verify a webhook, and nobody else's secret is good for it.")
@pytest.mark.parametrize("database_kind", DATABASES)
def test_a_job_that_is_done_is_said_once_and_signed(
    hooks: Farm, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    job_id = submit(hooks, receiver.url)
    hooks.work()
    assert hooks.job(job_id).status is JobStatus.DONE
    sender = sender_of(hooks)
    assert sender.send_next("k")
    assert not sender.send_next("k")
    got = receiver.next()
    assert (got.method, got.path, got.headers["Content-Type"]) == ("POST", "/hook?of=lippmann", "application/json")
    assert got.headers["Host"] == f"127.0.0.1:{receiver.port}"
    message = json.loads(got.body)
    assert (message["type"], message["data"]["id"], message["data"]["frames_done"]) == ("job.done", job_id, 3)
    (key,) = hooks.settings.link_keys.keys()

    def genuine(secret: str, what: Received = got, now_s: float = hooks.now_s) -> bool:
        return is_genuine(secret, what, now_s=now_s, monkeypatch=monkeypatch)

    assert genuine(secret_of(key, "k"))
    assert not genuine(secret_of(key, "somebody else"))
    assert not genuine(secret_of(key, "k"), Received(got.method, got.path, got.headers, got.body + b" "))
    other_id = got.headers | {"Webhook-Id": "msg_0"}
    assert not genuine(secret_of(key, "k"), Received(got.method, got.path, other_id, got.body))
    assert not genuine(secret_of(key, "k"), now_s=hooks.now_s + 301)
    assert pending(hooks) == []


def test_both_keys_sign_while_a_key_is_replaced(
    hooks: Farm, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = hooks.settings.link_keys.path
    file.write_text("a" * 64 + "\n" + file.read_text())
    cancelled(hooks, receiver.url)
    sender_of(hooks).send_next("k")
    got = receiver.next()
    keys = hooks.settings.link_keys.keys()
    assert len(keys) == 2
    assert all(is_genuine(secret_of(key, "k"), got, now_s=hooks.now_s, monkeypatch=monkeypatch) for key in keys)


def test_failed_and_cancelled_jobs_are_said_too_and_a_retried_one_again(hooks: Farm, receiver: Receiver) -> None:
    job_id = submit(hooks, receiver.url)
    (probe,) = hooks.dispatch()
    hooks.say(claimed(probe), failed(probe, permanent=True))
    sender = sender_of(hooks)
    sender.send_next("k")
    first = receiver.next()
    message = json.loads(first.body)
    assert (message["type"], message["data"]["error"]["code"]) == ("job.failed", "render-failed")
    with hooks.writing() as session:
        retry_job(session, job_id, now_s=hooks.now_s, limit=hooks.settings.failure_limit)
    with hooks.writing() as session:
        cancel_job(session, job_id, now_s=hooks.now_s)
    sender.send_next("k")
    second = receiver.next()
    assert json.loads(second.body)["type"] == "job.cancelled"
    assert json.loads(second.body)["data"]["error"] is None
    assert second.headers["Webhook-Id"] != first.headers["Webhook-Id"]


def test_a_message_is_repeated_with_pauses_that_grow_until_the_receiver_has_it(hooks: Farm, receiver: Receiver) -> None:
    receiver.answer = 500
    job_id = cancelled(hooks, receiver.url)
    sender = sender_of(hooks)
    sent: list[float] = []
    ids = set()
    for _ in range(100):
        if sender.send_next("k"):
            sent.append(hooks.now_s)
            ids.add(receiver.next().headers["Webhook-Id"])
            if len(sent) == 2:
                receiver.answer = 204
            if len(sent) < 3:
                error = f"attempt {len(sent)} of 8 to deliver the webhook: the receiver answered 500"
                assert hooks.job(job_id).webhook_error == error
        hooks.now_s += 1
    assert [after - before for before, after in pairwise(sent)] == [PAUSE_S, 4 * PAUSE_S]
    assert len(ids) == 1
    assert (pending(hooks), hooks.job(job_id).webhook_error) == ([], None)


def test_attempts_are_bounded_and_the_job_says_so(
    make_farm: Callable[..., Farm], receiver: Receiver, make_client: Callable[[Farm], Any]
) -> None:
    farm = hooked(make_farm, webhook_attempts=2, coordinator=False)
    receiver.answer = 503
    job_id = cancelled(farm, receiver.url)
    sender = sender_of(farm)
    for _ in range(5):
        sender.send_next("k")
        farm.now_s += 100_000
    assert receiver.received.qsize() == 2
    assert pending(farm) == []
    shown = make_client(farm).get(f"/api/v1/jobs/{job_id}").json()["webhook"]
    assert shown == {
        "host": f"127.0.0.1:{receiver.port}",
        "error": "the webhook was not delivered in 2 attempts: the receiver answered 503",
    }
    with farm.database.reading() as session:
        last = session.query(JobEvent).order_by(JobEvent.id.desc()).first()
    assert last is not None
    assert last.data["webhook"] == shown
    assert "hook?of" not in json.dumps(last.data)


def test_a_receiver_that_is_gone_is_asked_once(hooks: Farm, receiver: Receiver) -> None:
    receiver.answer = 410
    job_id = cancelled(hooks, receiver.url)
    sender_of(hooks).send_next("k")
    assert pending(hooks) == []
    assert hooks.job(job_id).webhook_error == "the webhook was not delivered: the receiver answered 410"


@pytest.mark.promise("People", "A webhook follows no redirect.")
def test_a_redirect_is_not_followed(hooks: Farm, receiver: Receiver) -> None:
    with receiving() as inside:
        receiver.answer, receiver.headers = 307, {"Location": inside.url}
        job_id = cancelled(hooks, receiver.url)
        sender_of(hooks).send_next("k")
        assert receiver.next()
        assert inside.received.empty()
    assert "answered 307" in (hooks.job(job_id).webhook_error or "")


def _endless_headers(handler: BaseHTTPRequestHandler) -> None:
    handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
    try:
        while True:
            handler.wfile.write(b"X: " + b"y" * 1000 + b"\r\n")
    except OSError:
        return


def _slow_headers(handler: BaseHTTPRequestHandler) -> None:
    try:
        for byte in b"HTTP/1.1 200 OK\r\n" * 1000:
            handler.wfile.write(bytes([byte]))
            time.sleep(0.05)
    except OSError:
        return


def _nonsense(handler: BaseHTTPRequestHandler) -> None:
    handler.wfile.write(b"SSH-2.0-OpenSSH_9\r\n\r\n")


def _interim(handler: BaseHTTPRequestHandler) -> None:
    handler.wfile.write(b"HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 200 OK\r\n\r\n")


@pytest.mark.promise("People", "What the receiver of a webhook answers is bounded in size and time.")
@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (_endless_headers, "the connection failed: LimitOverrunError"),
        (_slow_headers, "there was no answer within 0.5 s"),
        (_nonsense, "the answer was not HTTP"),
        (lambda handler: None, "the connection failed: IncompleteReadError"),
        (_interim, None),
    ],
)
def test_what_a_receiver_answers_is_bounded_in_size_and_time(
    make_farm: Callable[..., Farm], receiver: Receiver, answer: Any, error: str | None
) -> None:
    farm = hooked(make_farm, webhook_timeout_s=0.5)
    receiver.answer = answer
    job_id = cancelled(farm, receiver.url)
    sender_of(farm).send_next("k")
    expected = None if error is None else f"attempt 1 of 8 to deliver the webhook: {error}"
    assert farm.job(job_id).webhook_error == expected


def test_a_name_of_this_machine_is_refused_when_it_is_resolved(
    make_farm: Callable[..., Farm], receiver: Receiver
) -> None:
    farm = hooked(make_farm, webhook_hosts="")
    job_id = cancelled(farm, f"http://localhost:{receiver.port}/")
    sender_of(farm).send_next("k")
    assert receiver.received.empty()
    assert pending(farm) == []
    assert farm.job(job_id).webhook_error == (
        "the webhook was not delivered: the address of localhost is not public, and the farm does not name this host"
    )


@pytest.mark.promise("People", "A webhook goes to the address that was checked, also if its name changes.")
def test_the_connection_goes_to_the_address_that_was_checked(
    make_farm: Callable[..., Farm], receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name whose second answer is another address would lead the farm where it must not go."""
    farm = hooked(make_farm, webhook_hosts="rebinding.test")
    job_id = cancelled(farm, f"http://rebinding.test:{receiver.port}/hook")
    asked = []

    def answers(host: str, port: int, *_: Any, **__: Any) -> Any:
        asked.append(host)
        assert asked.count("rebinding.test") == 1
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("127.0.0.1", port))]

    monkeypatch.setattr(socket, "getaddrinfo", answers)
    sender_of(farm).send_next("k")
    assert receiver.next().headers["Host"] == f"rebinding.test:{receiver.port}"
    assert farm.job(job_id).webhook_error is None
    assert asked == ["rebinding.test"]


class _Killed(BaseException):
    """The process is killed here."""


def _die(*_: Any, **__: Any) -> Any:
    raise _Killed


@pytest.mark.parametrize("where", ["begin_attempt", "post", "remove", "set_error"])
def test_a_process_that_is_killed_anywhere_loses_no_message(
    hooks: Farm, receiver: Receiver, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    cancelled(hooks, receiver.url)
    monkeypatch.setattr(module if where == "post" else rows, where, _die)
    with pytest.raises(_Killed):
        sender_of(hooks).send_next("k")
    monkeypatch.undo()
    (left,) = pending(hooks)
    again = sender_of(hooks)
    hooks.now_s += PAUSE_S
    assert again.send_next("k")
    while receiver.received.qsize() > 1:
        assert receiver.next().headers["Webhook-Id"] == left.id
    assert receiver.next().headers["Webhook-Id"] == left.id
    assert pending(hooks) == []


def test_a_process_that_is_killed_in_each_attempt_does_not_try_without_end(
    hooks: Farm, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    job_id = cancelled(hooks, receiver.url)
    monkeypatch.setattr(module, "post", _die)
    for _ in range(hooks.settings.webhook_attempts):
        with pytest.raises(_Killed):
            sender_of(hooks).send_next("k")
        hooks.now_s += 100_000
    assert sender_of(hooks).send_next("k")
    assert pending(hooks) == []
    assert hooks.job(job_id).webhook_error == "the webhook was not delivered: the last attempt did not end"


def test_a_message_of_a_job_that_was_removed_still_comes(hooks: Farm, receiver: Receiver) -> None:
    job_id = cancelled(hooks, receiver.url)
    with hooks.writing() as session:
        remove_job(session, job_id)
    hooks.plan()
    sender_of(hooks).send_next("k")
    assert json.loads(receiver.next().body)["data"]["id"] == job_id
    assert pending(hooks) == []


def test_a_slow_receiver_delays_its_own_owner_only(hooks: Farm, receiver: Receiver) -> None:
    bob = Caller(id="b", key_id="b", name="bob", role=Role.SUBMITTER, owner_id="bob")
    ending = threading.Event()
    with receiving() as slow:
        slow.answer = lambda _: (ending.wait(ENOUGH_S), None)[1]
        for _ in range(3):
            cancelled(hooks, slow.url)
        cancelled(hooks, receiver.url, caller=bob)
        sender = sender_of(hooks)
        sender.run_round()
        assert slow.next()
        assert receiver.next()
        sender.run_round()  # starts no second thread for an owner who has one
        assert slow.received.empty()
        ending.set()
        until(lambda: slow.received.qsize() == 2)
        sender.join(timeout_s=ENOUGH_S)


def test_a_thread_that_cannot_be_started_silences_nobody(
    hooks: Farm, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    cancelled(hooks, receiver.url)
    sender = sender_of(hooks)

    def refuse(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", refuse)
        with pytest.raises(RuntimeError):
            sender.run_round()
    sender.run_round()
    assert receiver.next()
    sender.join(timeout_s=ENOUGH_S)


def test_a_receiver_with_tls_shows_a_certificate_of_a_known_authority_for_its_name(
    make_farm: Callable[..., Farm], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    farm = hooked(make_farm, webhook_http=False)
    authority = Authority(tmp_path)
    errors = {}
    for name, host, ca_file in (
        ("right", "127.0.0.1", authority.ca_file),
        ("another host", "127.0.0.2", authority.ca_file),
        ("another authority", "127.0.0.1", Authority(tmp_path, "other").ca_file),
    ):
        monkeypatch.setitem(os.environ, "SSL_CERT_FILE", str(ca_file))
        with receiving(tls=authority.server_context(host)) as receiver:
            job_id = cancelled(farm, receiver.url.replace("http:", "https:"))
            while sender_of(farm).send_next("k"):
                pass
            errors[name] = farm.job(job_id).webhook_error
    assert errors["right"] is None
    for name in ("another host", "another authority"):
        assert "the certificate is not valid for 127.0.0.1" in (errors[name] or ""), name


def test_without_a_key_file_a_message_waits(hooks: Farm, receiver: Receiver) -> None:
    hooks.settings.link_keys.path.unlink()
    job_id = cancelled(hooks, receiver.url)
    sender_of(hooks).send_next("k")
    assert receiver.received.empty()
    assert (hooks.job(job_id).webhook_error or "").endswith("the farm has no key to sign it with")
    assert len(pending(hooks)) == 1


def test_the_webhook_of_the_farm_gets_every_job_signed_for_its_admin_and_its_failures_are_not_the_jobs(
    make_farm: Callable[..., Farm], receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    farm = hooked(make_farm, webhook_url=receiver.url)
    job_id = farm.submit()
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    sender = sender_of(farm)
    assert not sender.send_next("k")
    assert sender.send_next(ADMIN_OWNER)
    got = receiver.next()
    assert json.loads(got.body)["data"]["id"] == job_id
    (key,) = farm.settings.link_keys.keys()
    assert is_genuine(secret_of(key, ADMIN_OWNER), got, now_s=farm.now_s, monkeypatch=monkeypatch)
    receiver.answer = 500
    both = cancelled(farm, receiver.url.replace("/hook", "/own"))
    assert sender.send_next(ADMIN_OWNER)
    assert farm.job(both).webhook_error is None
    assert sender.send_next("k")
    assert farm.job(both).webhook_error is not None
    assert [receiver.next().path for _ in range(2)] == ["/hook?of=lippmann", "/own?of=lippmann"]
