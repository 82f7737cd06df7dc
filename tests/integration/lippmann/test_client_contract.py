"""`lippmann.client.Client` and openapi.json agree: operations, parameters, fields of bodies, shapes of answers.

Every method is called against a real farm, and each request on the wire is looked up in the contract.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, cast

import httpx
import pytest
from pydantic import BaseModel

from lippmann.client import Client, Refused, ServerEvent
from povtemplates.catalogue import scene_folders
from service.openapi import FILE
from tests.farm import ended
from tests.integration.lippmann.conftest import Up
from tests.needs import needs_povray

pytestmark = needs_povray

CONTRACT: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
RIG = {"px_per_lens": 4, "lens_array": {"count": [4, 4]}}
SMALL = {"scene": "target-white", "rig": RIG, "outputs": ["view_grid.png"]}
NOT_NEEDED = {
    "GET /api/v1/links/{job_id}/{name}": "whoever has the URL opens it without a key",
    "GET /api/v1/scenes/{name}/poster.png": "a picture for the lists of the dashboard",
    "GET /api/v1/jobs/{job_id}/frames/statuses": "what the dashboard draws; GET .../frames says the same in pages",
    "GET /api/v1/jobs/{job_id}/attempts": "what the dashboard draws; GET .../tasks has the attempts",
    "GET /api/v1/jobs/{job_id}/events": "GET /api/v1/events gives the same for one job",
    "POST /api/v1/design/check": "a form asks it while somebody writes; POST /api/v1/design says the same in one error",
    "GET /api/v1/schemas/{name}": "`JobSpec.model_json_schema()` gives the same",
    "GET /api/v1/waiting": "autoscalers read it",
    "GET /api/v1/worker-keys": "its own tests call it",
    "POST /api/v1/worker-keys": "its own tests call it",
    "PUT /api/v1/workers/{worker}/drain": "its own tests call it",
    "DELETE /api/v1/workers/{worker}/drain": "its own tests call it",
    "PUT /api/v1/workers/{worker}/exclusion": "its own tests call it",
    "DELETE /api/v1/workers/{worker}/exclusion": "its own tests call it",
    "DELETE /api/v1/workers/{worker}/faults": "its own tests call it",
    "POST /api/v1/jobs/{job_id}/tasks/{task_id}/restart": "its own tests call it",
    "POST /api/v1/jobs/{job_id}/tasks/{task_id}/end": "its own tests call it",
    "GET /api/v1/sessions": "browser sessions are ended on the page of the keys",
    "DELETE /api/v1/sessions/{session_id}": "browser sessions are ended on the page of the keys",
}
"""The operations that the client leaves out, and why."""


class Wire:
    """The requests that were sent, and the operations of the contract that they are."""

    def __init__(self) -> None:
        self.operations: list[str] = []
        self._paths = {path: re.compile(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(path))) for path in CONTRACT["paths"]}
        # The name of an artifact holds slashes.
        name = "/api/v1/jobs/{job_id}/artifacts/{name}"
        self._paths[name] = re.compile("/api/v1/jobs/[^/]+/artifacts/.+")

    def note(self, request: httpx.Request) -> None:
        """Look a request up, with its query and its body."""
        (path,) = [path for path, pattern in self._paths.items() if pattern.fullmatch(request.url.path)]
        method = "GET" if request.method == "HEAD" else request.method
        operation = CONTRACT["paths"][path][method.lower()]
        self.operations.append(f"{method} {path}")
        queries = {one["name"] for one in operation.get("parameters", ()) if one["in"] == "query"}
        assert set(request.url.params) <= queries, self.operations[-1]
        content = operation.get("requestBody", {}).get("content", {})
        body = request.read()
        if "multipart/form-data" in content:
            names = set(re.findall(rb'name="(\w+)"', body))
            assert {name.decode() for name in names} == set(schema_of(content["multipart/form-data"])["properties"])
        elif body:
            schema, sent = schema_of(content["application/json"]), set(json.loads(body))
            assert set(schema.get("required", ())) <= sent <= set(schema["properties"]), self.operations[-1]


def schema_of(media: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a body; one that may be left out is that or null."""
    schema: dict[str, Any] = media["schema"]
    schema = schema.get("anyOf", [schema])[0]
    found: dict[str, Any] = CONTRACT["components"]["schemas"][name_of(schema)] if "$ref" in schema else schema
    return found


def name_of(schema: dict[str, Any]) -> str:
    return str(schema["$ref"]).rpartition("/")[2]


def answered(operation: str) -> str:
    """Return the name of the schema with which an operation answers, or that of the items of its page."""
    method, _, path = operation.partition(" ")
    responses = CONTRACT["paths"][path][method.lower()]["responses"]
    (schema,) = {
        name_of(one["content"]["application/json"]["schema"]) for code, one in responses.items() if code[0] == "2"
    }
    return schema


def item_of(page: str) -> str:
    return name_of(CONTRACT["components"]["schemas"][page]["properties"]["items"]["items"])


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    wire, send = Wire(), httpx.Client.send

    def noted(client: httpx.Client, request: httpx.Request, **options: Any) -> httpx.Response:
        wire.note(request)
        return send(client, request, **options)

    monkeypatch.setattr(httpx.Client, "send", noted)
    return wire


def calls(client: Client, job_id: str, out: Path) -> Iterator[Callable[[], Any]]:
    """Yield a call of every method that is one request."""
    yield client.health
    yield client.workers
    yield client.caller
    yield client.usage
    yield client.scenes
    yield lambda: client.scene("fish")
    yield lambda: client.upload_scene("mine", bundle())
    yield lambda: client.remove_scene("mine")
    yield lambda: client.design(SMALL, frame=1)
    yield lambda: client.preview(SMALL, frame=1, lenses=4, px_per_lens=2, stream="s")
    yield lambda: client.submit(SMALL, webhook=None)
    yield lambda: client.job(job_id)
    yield lambda: client.jobs(status="done", limit=2)
    for act in (client.cancel, client.pause, client.resume, client.retry, client.repair):
        yield lambda act=act: act(job_id)  # type: ignore[misc]
    yield lambda: client.skip(job_id, [1])
    yield lambda: client.prioritise(job_id, 60)
    yield lambda: client.share(job_id)
    yield lambda: client.tasks(job_id, status="done", kind="render", limit=2)
    task = next(client.tasks(job_id)).id
    yield lambda: client.task(job_id, task)
    yield lambda: client.log(job_id, task, attempt=1)
    yield lambda: client.frames(job_id, limit=2)
    yield lambda: first_event(client, job_id)
    yield lambda: client.artifacts(job_id, prefix="orthoscopic")
    yield lambda: client.download(job_id, "orthoscopic/0001.exr", out / "1.exr")
    yield lambda: client.download(job_id, "orthoscopic/0001.exr", out / "1.png", format="png", bits=16)
    yield lambda: client.download_output(job_id, "view_grid.png", out / "grid.zip")
    yield lambda: client.artifact_link(job_id, "job.json", expires_in_s=60)
    yield lambda: client.frame_views(job_id, 1)
    yield lambda: client.download_picture(job_id, 1, "view", out / "v.png", u=0, v=1, format="png")
    yield lambda: client.download_picture(job_id, 1, "perspective", out / "p.png", x=1, y=0, z=500)
    yield lambda: client.download_picture(job_id, 1, "refocus", out / "r.png", depth_mm=1)
    yield lambda: client.download_picture(job_id, 1, "observer", out / "o.png")
    yield lambda: client.download_picture(job_id, 1, "views.atlas", out / "a.png")
    yield lambda: client.download_picture(job_id, 1, "depth.map", out / "d.pfm")
    yield lambda: client.focus_depth(job_id, 1, x=0.5, y=0.5)
    yield client.webhook_secret
    yield client.keys
    key = client.create_key("x", "viewer", owner_id="x", expires_in_days=1, limits={"open_jobs": 1})
    yield lambda: client.revoke_key(key.id)
    yield client.farm_work
    yield lambda: client.farm_history(hours=2)
    yield client.farm_owners
    yield lambda: client.audit(limit=2, action="create-key", name="tester", subject="x")
    yield client.login_link
    yield lambda: client.delete(job_id)


def first_event(client: Client, job_id: str) -> None:
    with closing(cast("Generator[ServerEvent]", client.events(job_id))) as events:
        next(events)


def bundle() -> bytes:
    folder, data = scene_folders()["target-white"], io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for file in folder.iterdir():
            archive.write(file, file.name)
    return data.getvalue()


def test_every_operation_that_a_user_needs_has_a_method_which_keeps_to_the_contract(
    farm: Up, wire: Wire, tmp_path: Path
) -> None:
    with farm.client() as client:
        job_id = client.submit(SMALL).id
        assert ended(client, job_id).status == "done"
        for call in calls(client, job_id, tmp_path):
            try:
                result = call()
                items = list(result) if isinstance(result, Iterator) else [result]
            except Refused as error:
                if error.status != 409:
                    raise
                continue  # The action is not allowed now, but it is one of the service.
            operation = wire.operations[-1]
            for one in items:
                if isinstance(one, BaseModel):
                    schema = answered(operation) if one is result else item_of(answered(operation))
                    assert type(one).__name__ == schema, operation
                    assert set(type(one).model_fields) == set(CONTRACT["components"]["schemas"][schema]["properties"])
    everything = {f"{method.upper()} {path}" for path, methods in CONTRACT["paths"].items() for method in methods}
    assert everything - set(wire.operations) == set(NOT_NEEDED)
