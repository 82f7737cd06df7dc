"""Who may call which route: every route, every role, one's own jobs and those of others.

The routes come from the application, and a route without a line in `RULES` fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from fastapi.routing import iter_route_contexts
from sqlalchemy import func, select

from service.auth import Caller, create_key, create_login_token
from service.browser_sessions import open_session
from service.db.tables import AuditRow, Scene
from service.jobs.submission import submit_job
from service.main import create_app
from service.schemas.access import Role
from tests.builders_service import SPEC, Client, Farm

OPEN, SEE, SUBMIT, CHANGE, ADMIN = "open to all", "see", "submit", "change", "admin"
SIGNED = "whoever has a signed link"
NO_KEY, NO_ROLE, HIDDEN, ALLOWED = 401, 403, 404, "allowed"

RULES: dict[str, tuple[str, bool]] = {
    "GET /": (OPEN, False),
    "GET /static/{name:path}": (OPEN, False),
    "GET /docs": (SEE, False),
    "GET /help/{name:path}": (SEE, False),
    "GET /login": (OPEN, True),
    "POST /login": (OPEN, True),
    "POST /logout": (OPEN, True),
    "GET /api/v1/health": (OPEN, False),
    "GET /api/v1/openapi.json": (SEE, False),
    "GET /api/v1/schemas/{name}": (SEE, False),
    "GET /api/v1/session": (SEE, False),
    "GET /api/v1/workers": (SEE, False),
    "GET /metrics": (SEE, False),
    "GET /api/v1/waiting": (SEE, False),
    "PUT /api/v1/workers/{worker:path}/drain": (ADMIN, True),
    "DELETE /api/v1/workers/{worker:path}/drain": (ADMIN, True),
    "PUT /api/v1/workers/{worker:path}/exclusion": (ADMIN, True),
    "DELETE /api/v1/workers/{worker:path}/exclusion": (ADMIN, True),
    "DELETE /api/v1/workers/{worker:path}/faults": (ADMIN, True),
    "GET /api/v1/farm": (SEE, False),
    "GET /api/v1/farm/history": (SEE, False),
    "GET /api/v1/farm/owners": (SEE, False),
    "POST /api/v1/design": (SEE, False),
    "POST /api/v1/design/check": (SEE, False),
    "POST /api/v1/preview": (SUBMIT, False),
    "GET /api/v1/events": (SEE, False),
    "GET /api/v1/scenes": (SEE, False),
    "GET /api/v1/scenes/{name}": (SEE, False),
    "GET /api/v1/scenes/{name}/poster.png": (SEE, False),
    "POST /api/v1/scenes": (SUBMIT, True),
    "DELETE /api/v1/scenes/{name}": (CHANGE, True),
    "GET /api/v1/jobs": (SEE, False),
    "POST /api/v1/jobs": (SUBMIT, True),
    "GET /api/v1/jobs/{job_id}": (SEE, False),
    "PATCH /api/v1/jobs/{job_id}": (CHANGE, True),
    "DELETE /api/v1/jobs/{job_id}": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/cancel": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/pause": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/resume": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/retry": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/repair": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/skip": (CHANGE, True),
    "GET /api/v1/jobs/{job_id}/events": (SEE, False),
    "GET /api/v1/jobs/{job_id}/tasks": (SEE, False),
    "GET /api/v1/jobs/{job_id}/tasks/{task_id}": (SEE, False),
    "GET /api/v1/jobs/{job_id}/tasks/{task_id}/log": (SEE, False),
    "POST /api/v1/jobs/{job_id}/tasks/{task_id}/restart": (CHANGE, True),
    "POST /api/v1/jobs/{job_id}/tasks/{task_id}/end": (CHANGE, True),
    "GET /api/v1/jobs/{job_id}/attempts": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/statuses": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/look": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/view": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/perspective": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/refocus": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/observer": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/views.atlas": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/depth": (SEE, False),
    "GET /api/v1/jobs/{job_id}/frames/{frame}/depth.map": (SEE, False),
    "GET /api/v1/jobs/{job_id}/artifacts": (SEE, False),
    "GET /api/v1/jobs/{job_id}/artifacts/{name:path}": (SEE, False),
    "HEAD /api/v1/jobs/{job_id}/artifacts/{name:path}": (SEE, False),
    "GET /api/v1/jobs/{job_id}/outputs/{name}.zip": (SEE, False),
    "POST /api/v1/jobs/{job_id}/links": (SEE, True),
    "GET /api/v1/links/{job_id}/{name:path}": (SIGNED, False),
    "HEAD /api/v1/links/{job_id}/{name:path}": (SIGNED, False),
    "GET /api/v1/keys": (ADMIN, False),
    "POST /api/v1/keys": (ADMIN, True),
    "DELETE /api/v1/keys/{key_id}": (ADMIN, True),
    "GET /api/v1/worker-keys": (ADMIN, False),
    "POST /api/v1/worker-keys": (ADMIN, True),
    "GET /api/v1/sessions": (ADMIN, False),
    "DELETE /api/v1/sessions/{session_id}": (ADMIN, True),
    "POST /api/v1/login-tokens": (ADMIN, True),
    "GET /api/v1/audit": (ADMIN, False),
    "GET /api/v1/usage": (SEE, False),
    "GET /api/v1/webhook-secret": (SUBMIT, False),
}
"""The rule of each route, and whether a request that succeeds changes something, which the audit log records."""

OPENID_ROUTES = {"GET /login/oidc", "GET /login/oidc/callback"}
"""The routes that are there with an OpenID provider only; they are open to all, see `routes/test_openid.py`."""

OWNER = "ann"
"""The owner of the jobs and of the scene of the requests."""
SCENE = "anns"
"""A scene of that owner."""
CALLERS: dict[str, tuple[Role, str] | None] = {
    "nobody": None,
    "viewer, own": (Role.VIEWER, OWNER),
    "viewer, other": (Role.VIEWER, "bob"),
    "submitter, own": (Role.SUBMITTER, OWNER),
    "submitter, other": (Role.SUBMITTER, "bob"),
    "admin, other": (Role.ADMIN, "bob"),
}
_IS_OF_A_JOB = "{job_id}"
REMOVE_SCENE = "DELETE /api/v1/scenes/{name}"


def _has_owner(route: str) -> bool:
    return _IS_OF_A_JOB in route or route == REMOVE_SCENE


def _expected(route: str, who: str, *, sharing: bool) -> int | str:
    rule, given = RULES[route][0], CALLERS[who]
    if rule == OPEN:
        return ALLOWED
    if given is None or rule == SIGNED:
        return NO_KEY  # No key is as good as a link, whose tests are in routes/test_links.py.
    role, owner_id = given
    needed = {SEE: Role.VIEWER, SUBMIT: Role.SUBMITTER, CHANGE: Role.SUBMITTER, ADMIN: Role.ADMIN}[rule]
    if not role.allows(needed):
        return NO_ROLE
    if _has_owner(route) and owner_id != OWNER and role is not Role.ADMIN:
        return HIDDEN if not sharing else NO_ROLE if rule == CHANGE else ALLOWED
    return ALLOWED


@dataclass
class Door:
    """A farm, a client without a key, and the keys of all callers."""

    farm: Farm
    client: Client
    headers: dict[str, dict[str, str]]
    job_id: str = ""
    """A job that nobody changes."""

    def __post_init__(self) -> None:
        self.job_id = self._job()

    def ask(self, route: str, who: str) -> int | str:
        """Send a request that is right in every other way, and return whether the caller is let in."""
        method, _, path = route.partition(" ")
        job_id = "" if _IS_OF_A_JOB not in path else self.job_id if method in ("GET", "HEAD") else self._job()
        values = {
            _IS_OF_A_JOB: job_id, "{task_id}": f"{job_id}.0", "{frame}": "1",
            "{name}": self._scene() if route == REMOVE_SCENE else "ball",
            "{name:path}": "job.json" if job_id else "shared/base.css",
            "{key_id}": self._new_key(Role.VIEWER, "x")[0] if "{key_id}" in path else "",
            "{session_id}": self._new_session() if "{session_id}" in path else "",
        }  # fmt: skip
        for placeholder, value in values.items():
            path = path.replace(placeholder, value)
        body, before = self._body(route), self._audited()
        headers = self.headers[who] | {"X-Lippmann-Request": "1"}
        answer = self.client.request(method, path, headers=headers, follow_redirects=False, **body)
        self.client.cookies.clear()
        changes = RULES[route][1] and answer.status_code < 400
        assert self._audited() - before == int(changes), (route, who, answer.text)
        if answer.status_code in (NO_KEY, NO_ROLE):
            return int(answer.status_code)
        hidden = (f"there is no job '{job_id}'", f"there is no scene '{SCENE}'")
        is_hidden = answer.status_code == HIDDEN and any(text in answer.text for text in hidden)
        return HIDDEN if is_hidden or (method == "HEAD" and answer.status_code == HIDDEN) else ALLOWED

    def _body(self, route: str) -> dict[str, Any]:
        bodies: dict[str, dict[str, Any]] = {
            "POST /api/v1/jobs": {"json": SPEC},
            "POST /api/v1/design": {"json": SPEC},
            "POST /api/v1/design/check": {"json": SPEC},
            "POST /api/v1/preview": {"json": SPEC},
            "PATCH /api/v1/jobs/{job_id}": {"json": {"priority": 60}},
            "POST /api/v1/keys": {"json": {"name": "new"}},
            "POST /api/v1/worker-keys": {"json": {"name": "new", "broker_user": "given"}},
            "POST /api/v1/jobs/{job_id}/links": {"json": {"artifact": "job.json"}},
            "POST /api/v1/scenes": {
                "params": {"name": f"new-{self._audited()}"},
                "files": {"bundle": ("b.zip", f"PK {self._audited()}".encode(), "application/zip")},
            },
        }
        if route == "GET /login":
            with self.farm.writing() as session:
                return {"params": {"token": create_login_token(session, now_s=self.farm.now_s)}}
        if route == "POST /login":
            return {"data": {"key": self._new_key(Role.VIEWER, "x")[1]}}
        if route == "POST /logout":
            self.client.post("/login", data={"key": self._new_key(Role.VIEWER, "x")[1]})
        return bodies.get(route, {})

    def _job(self) -> str:
        ann = Caller(id="a", key_id="a", name="ann", role=Role.SUBMITTER, owner_id=OWNER)
        job, _ = submit_job(
            self.farm.database,
            self.farm.parts,
            ann,
            SPEC,
            idempotency_key=None,
            now_s=self.farm.now_s,
            settings=self.farm.settings,
        )
        return job.id

    def _scene(self) -> str:
        with self.farm.writing() as session:
            ball = session.get_one(Scene, "ball")
            session.merge(
                Scene(
                    name=SCENE, digest=ball.digest, card=ball.card, builtin=False, owner=OWNER, owner_id=OWNER,
                    poster=None, updated_s=self.farm.now_s,
                )
            )  # fmt: skip
        return SCENE

    def _new_key(self, role: Role, owner_id: str) -> tuple[str, str]:
        with self.farm.writing() as session:
            return create_key(session, role.value, role, owner_id=owner_id, now_s=self.farm.now_s)

    def _new_session(self) -> str:
        with self.farm.writing() as session:
            _, caller = open_session(session, "x", Role.VIEWER, owner_id="x", now_s=self.farm.now_s, session_s=60.0)
            return caller.id

    def _audited(self) -> int:
        with self.farm.database.reading() as session:
            return session.scalar(select(func.count()).select_from(AuditRow)) or 0


@contextmanager
def _door(farm: Farm) -> Iterator[Door]:
    with Client(
        create_app(farm.settings, farm.parts, clock=lambda: farm.now_s), raise_server_exceptions=False
    ) as client:
        client.app.state.lippmann.hub.end_streams()  # type: ignore[attr-defined]  # so that event streams end at once
        door = Door(farm, client, {"nobody": {}})
        for who, given in CALLERS.items():
            if given is not None:
                door.headers[who] = {"Authorization": f"Bearer {door._new_key(*given)[1]}"}
        yield door


def _routes(farm: Farm) -> set[str]:
    routes = iter_route_contexts(create_app(farm.settings, farm.parts).routes)
    return {f"{method} {route.path}" for route in routes for method in route.methods or ("every method of",)}


def test_every_route_has_a_rule_and_every_rule_a_route(api_farm: Farm) -> None:
    assert _routes(api_farm) == set(RULES)


def test_a_farm_with_a_provider_has_two_more_routes(make_farm: Callable[..., Farm]) -> None:
    farm = make_farm(oidc_issuer="https://id.example", oidc_client_id="farm")
    assert _routes(farm) - set(RULES) == OPENID_ROUTES


@pytest.mark.parametrize("sharing", [True, False])
def test_every_role_may_do_what_the_rules_say_and_no_more(make_farm: Callable[..., Farm], *, sharing: bool) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", sharing=sharing, store_url="s3://farm")
    with _door(farm) as door:
        # Sharing is about jobs and scenes of users, so the other routes are asked only once.
        asked = [(route, who) for route in RULES if sharing or _has_owner(route) for who in CALLERS]
        found = {(route, who): door.ask(route, who) for route, who in asked}
    expected = {(route, who): _expected(route, who, sharing=sharing) for route, who in asked}
    assert {case: (found[case], expected[case]) for case in asked if found[case] != expected[case]} == {}
