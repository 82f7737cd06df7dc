"""The lines between a worker and the program inside the sandbox are read back as they were written, and bounded."""

from __future__ import annotations

import json
from typing import Any

import pytest

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import parse_spec
from worker.engines.mitsuba.inside.messages import (
    MAX_LINE_BYTES,
    MAX_MESSAGE,
    Failure,
    Progress,
    Request,
    Result,
    read_answer,
    read_request,
)

STAGE = Stage(location=(0, 0, -10), look_at=(0, 0, 0), near_mm=900, far_mm=1100)
MANIFEST = SceneManifest(title="A", stage=STAGE).model_copy(update={"file": "scene.xml"})
JOB = ResolvedJob.of("j", parse_spec({"scene": "mine", "render": {"samples": 4}}), MANIFEST, bundle="b")


def request(**changes: Any) -> Request:
    values = {
        "number": 7, "job": JOB.at(1), "frame": 1, "rows": 720, "cols": 720, "region": (0, 20, 8, 720),
        "channels": ("depth", "normal"), "bundle": "/scenes/a", "out": "7",
    }  # fmt: skip
    return Request(**(values | changes))


def test_a_request_is_read_back_from_its_line() -> None:
    line = request().line()
    assert line.count(b"\n") == 1
    assert line.endswith(b"\n")
    assert read_request(line) == request()


@pytest.mark.parametrize(
    "answer",
    [
        Progress(progress=0.5),
        Result(number=7, files={"radiance": "7-radiance.f32"}, load_s=1, trace_s=2, trace_cpu_s=3, notes=("a note",)),
        Failure.of(7, "scene", "The file a.ply is missing."),
        Failure.of(None, "internal", "x"),
    ],
)
def test_an_answer_is_read_back_from_its_line(answer: Progress | Result | Failure) -> None:
    assert read_answer(answer.line()) == answer


def test_a_request_names_the_files_of_its_result_and_their_exact_sizes() -> None:
    asked = request()
    assert asked.kinds == ("radiance", "distance", "normal")
    assert [asked.file_name(kind) for kind in asked.kinds] == ["7-radiance.f32", "7-distance.f32", "7-normal.f32"]
    assert [asked.file_bytes(kind) for kind in asked.kinds] == [4 * 20 * 712 * n for n in (3, 1, 3)]


def test_a_request_for_channels_alone_has_no_light_and_one_for_nothing_is_refused() -> None:
    assert request(light=False).kinds == ("distance", "normal")
    with pytest.raises(ValueError, match="expected channels in a request without light, got none"):
        request(light=False, channels=())


@pytest.mark.parametrize("region", [(0, 0, 0, 1), (5, 4, 0, 1), (0, 721, 0, 720), (0, 1, 700, 721), (-1, 1, 0, 1)])
def test_a_region_outside_the_picture_is_refused(region: tuple[int, int, int, int]) -> None:
    with pytest.raises(ValueError, match="region"):
        request(region=region)


@pytest.mark.parametrize("name", ["../7", "/tmp/7", "", ".7", "a/b", "7\n", "x" * 101])
def test_a_name_that_is_no_plain_file_name_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="out"):
        request(out=name)
    answer = {"number": 7, "files": {"radiance": name}, "load_s": 0, "trace_s": 0, "trace_cpu_s": 0}
    with pytest.raises(ValueError, match="radiance"):
        read_answer(json.dumps(answer).encode())


@pytest.mark.parametrize(
    "line",
    [
        b"", b"[]", b"{}", b"{", b"\xff\xfe", b'{"progress": 2}', b'{"progress": NaN}', b'{"progress": 0.5, "more": 1}',
        b'{"number": 7, "files": {"passwd": "a"}, "load_s": 0, "trace_s": 0, "trace_cpu_s": 0}',
        b'{"number": 7, "files": {}, "load_s": -1, "trace_s": 0, "trace_cpu_s": 0}',
        b'{"number": 7, "files": {}, "load_s": 1e400, "trace_s": 0, "trace_cpu_s": 0}',
        b'{"number": 7, "error": {"kind": "other", "message": ""}}',
        b" " * (MAX_LINE_BYTES + 1),
    ],
)  # fmt: skip
def test_a_line_that_is_no_answer_is_refused(line: bytes) -> None:
    with pytest.raises(ValueError, match=r"validation error|expected a line"):
        read_answer(line)


def test_the_message_of_a_failure_is_cut() -> None:
    assert len(Failure.of(1, "scene", "x" * 10_000).error.message) == MAX_MESSAGE
