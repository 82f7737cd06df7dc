"""Text from strangers, through the real application: every bomb is a 4xx, at once, that names field and limit.

The time of a request is that of this process alone, so a busy machine does not count.
"""

from __future__ import annotations

import io
import json
import time
import zipfile
from collections.abc import Iterator
from typing import Any

import pytest

from povtemplates.catalogue import scene_folders
from tests.builders_service import Client
from tests.security.text_app import running_app

SCENE_TOML = (scene_folders()["target-white"] / "scene.toml").read_bytes()
MAX_CPU_S = 1.0
MAX_ANSWER_BYTES = 100_000


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with running_app(tmp_path_factory.mktemp("app")) as client:
        yield client


def bundle(files: dict[str, bytes] | None = None) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {"scene.inc": b"", "scene.toml": SCENE_TOML, **(files or {})}.items():
            archive.writestr(name, content)
    return data.getvalue()


def patched(*, local: int, central: int, value: int) -> bytes:
    """Return a bundle whose headers have another byte at these offsets."""
    data = bytearray(bundle())
    for mark, offset in ((b"PK\x03\x04", local), (b"PK\x01\x02", central)):
        data[data.index(mark) + offset] = value
    return bytes(data)


def refused(client: Client, path: str, **request: Any) -> tuple[int, str]:
    """Send a request, and return the status and the message of the refusal."""
    began_s = time.process_time()
    answer = client.post(path, **request)
    assert time.process_time() - began_s < MAX_CPU_S
    assert len(answer.content) < MAX_ANSWER_BYTES
    assert answer.headers["Content-Type"] == "application/problem+json"
    return answer.status_code, answer.json()["detail"]


ZIPS = {
    "dotted-key": (bundle({"scene.toml": b"a" + b".a" * 12_000 + b" = 1"}), "dotted keys of at most 16 parts"),
    "nested-lists": (bundle({"scene.toml": b"a = " + b"[" * 100_000}), "expected at most 10,000 keys and items"),
    "deep-lists": (bundle({"scene.toml": b"a = " + b"[" * 5000}), "expected at most 32 levels of brackets"),
    "deep-objects": (bundle({"scene.toml": b"a = " + b"{a = " * 5000}), "expected at most 32 levels of brackets"),
    "huge-number": (bundle({"scene.toml": b"a = " + b"1" * 5000}), "numbers and bare keys of at most 400 characters"),
    "many-keys": (bundle({"scene.toml": b"a = 1\n" * 15_000}), "expected at most 10,000 keys"),
    "unknown-keys": (
        bundle({"scene.toml": b"".join(b"u%d = 1\n" % number for number in range(9000))}),
        "no further problems",
    ),
    "nul-in-toml": (bundle({"scene.toml": b"a = 1\x00"}), "expected TOML in UTF-8"),
    "deep-folders": (bundle({"d/" * 1000 + "a.inc": b""}), "names of at most 1000 bytes"),
    "folders": (bundle({"d/" * 50 + "a.inc": b""}), "names of at most 16 parts"),
    "many-folders": (bundle({f"{number}/a.inc": b"" for number in range(1500)}), "at most 1,000 folders"),
    "many-files": (bundle({f"{number}.inc": b"" for number in range(2500)}), "at most 2000 files"),
    "many-names": (bundle({f"{number:0200}": b"" for number in range(9000)}), "list of entries of at most 2,000,000"),
    "patched": (patched(local=6, central=8, value=0x20), "neither encrypted nor a patch"),
    "encrypted": (patched(local=6, central=8, value=0x40), "neither encrypted nor a patch"),
    "version": (patched(local=4, central=6, value=255), "zip file version 25.5"),
    "manifest-is-a-folder": (bundle({"scene.toml/": b""}), "both as a file and as a folder"),
    "right-to-left": (bundle({"a\N{RIGHT-TO-LEFT OVERRIDE}gnp.inc": b""}), "marks of direction"),
    "control-character": (bundle({"a\x1b[2J.inc": b""}), "control characters"),
    "case": (bundle({"A.inc": b"", "a.inc": b""}), "differ by more than case"),
    "normal-form": (bundle({"\xe9.inc": b"", "e\u0301.inc": b""}), "the composition of accents"),
    "device": (bundle({"NUL.inc": b""}), "devices of Windows"),
    "settings": (bundle({".povray/3.7/povray.conf": b""}), "hidden settings of POV-Ray"),
    "no-zip": (b"PK\x05\x06" + bytes(17), "expected a zip"),
}


@pytest.mark.promise("Scenes", "A hostile bundle is refused before it is stored.")
@pytest.mark.parametrize("name", ZIPS)
def test_a_hostile_bundle_is_refused(client: Client, name: str) -> None:
    data, message = ZIPS[name]
    status, detail = refused(client, "/api/v1/scenes?name=hostile", files={"bundle": ("a.zip", data)})
    assert status == 422
    assert message in detail


JSONS = {
    "unknown-fields": (
        json.dumps({f"u{number}": 0 for number in range(150_000)}),
        "body: expected at most 10,000 names of fields, got 150,000",
    ),
    "unknown-fields-below-the-limit": (
        json.dumps({f"u{number}": 0 for number in range(9999)}),
        "(whole): expected no further problems, got 9,950 more",
    ),
    "deep-lists": ("[" * 100_000, "body: expected at most 64 levels of brackets"),
    "deep-objects": ('{"a":' * 9000, "body: expected at most 64 levels of brackets"),
    "many-values": ("[" + "0," * 900_000 + "0]", "body: expected at most 120,000 values"),
    "huge-number": ('{"priority": ' + "1" * 5000 + "}", "body: expected whole numbers of at most 400 digits"),
    "half-a-pair": ('{"title": "\\ud800"}', "title: expected text of whole characters"),
    "half-a-pair-in-a-name": ('{"\\ud800": 1}', "body: expected text of whole characters"),
    "not-a-number": ('{"fps": NaN}', "body: expected JSON, got NaN"),
    "infinite": ('{"scene": "fish", "fps": 1e999}', "fps: expected"),
    "no-object": ("[]", "expected a job as a JSON object"),
    "long-text": (json.dumps({"scene": "x" * 1_900_000}), "scene: expected"),
    "long-name": (json.dumps({"x" * 1_900_000: 1}), "no field of this name"),
    "many-outputs": (
        json.dumps({"scene": "fish", "outputs": [{}] * 50_000}),
        "outputs: expected at most 100 outputs, got 50000",
    ),
    "kind-is-a-list": (json.dumps({"scene": "fish", "outputs": [{"kind": ["views"]}]}), "outputs.0.kind: expected one"),
    "many-parameters": (
        json.dumps({"scene": "fish", "parameters": {f"u{number}": [0] for number in range(9000)}}),
        "parameters: expected at most 1000 parameters, got 9000",
    ),
    "many-frames": (json.dumps({"scene": "fish", "frames": "1-999999," * 100 + "1"}), "frames"),
    "keyframes": (
        json.dumps({"scene": "fish", "rig": {"lens_array": {"offset_mm": {"keyframes": [[1, 0]] * 30_000}}}}),
        "keyframes",
    ),
}


@pytest.mark.promise("Scenes", "A hostile job file is refused.")
@pytest.mark.parametrize("name", JSONS)
@pytest.mark.parametrize("path", ["/api/v1/jobs", "/api/v1/design"])
def test_a_hostile_job_is_refused(client: Client, path: str, name: str) -> None:
    text, message = JSONS[name]
    status, detail = refused(client, path, content=text, headers={"Content-Type": "application/json"})
    assert status == 422
    assert message in detail


@pytest.mark.parametrize("kind", ["application/json", "Application/Problem+JSON; charset=utf-16"])
def test_no_type_of_json_gets_around_the_reader(client: Client, kind: str) -> None:
    status, detail = refused(client, "/api/v1/jobs", content="[" * 1000, headers={"Content-Type": kind})
    assert (status, detail) == (422, "body: expected at most 64 levels of brackets, got more")


def test_an_honest_job_and_bundle_are_accepted_after_all_this(client: Client) -> None:
    assert client.post("/api/v1/scenes?name=honest", files={"bundle": ("a.zip", bundle())}).status_code == 201
    assert client.post("/api/v1/jobs", json={"scene": "honest", "frames": "1-3"}).status_code == 201


def test_a_file_of_a_job_with_a_slash_at_its_end_is_not_found(client: Client) -> None:
    job_id = client.post("/api/v1/jobs", json={"scene": "fish"}).json()["id"]
    for name in ("job.json/", "job.json/x", "%00", "a" * 300, "a/" * 3000):
        assert client.get(f"/api/v1/jobs/{job_id}/artifacts/{name}").status_code in (404, 422), name
