"""The program in the sandbox answers each line with lines of its own, keeps its scene, and survives what fails."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from worker.engines.mitsuba.inside.messages import Failure, Progress, Request, Result, read_answer

CHILD = """
import os, sys
from types import SimpleNamespace
from lippmann.errors import SceneError
from worker.engines.mitsuba.inside.program import main

def load(bundle, job, clock):
    import mitsuba as mi
    print("not an answer")
    os.write(1, b"not an answer either\\n")
    if bundle.name == "bad":
        raise SceneError("The file a.ply is missing.")
    if bundle.name == "broken":
        raise RuntimeError("vertex 3 is not a number")
    if bundle.name == "bug":
        raise KeyError("bug")
    sky = {"type": "constant", "radiance": 0.5}
    reads = {"still": (), "staged": ("stage",)}.get(bundle.name, ("clock",))
    scene = {"type": "scene", "sky": sky}
    if bundle.name == "named":
        scene |= {f"ball{k}": {"type": "sphere", "center": [k, 0, -1000]} for k in range(3)}
    if bundle.name == "grown" and clock > 0:
        scene |= {"ball": {"type": "sphere"}}
    names = {"ball0": "big \\u00fc\\nball", "ball1": "x" * 61}
    return SimpleNamespace(scene=mi.load_dict(scene), notes=("a note",), reads=reads, names=names)

main("llvm_ad_rgb", 1, load)
"""


class Child:
    """The program as a child process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )  # fmt: skip

    def ask(self, line: bytes) -> tuple[list[Progress], Result | Failure]:
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write(line)
        self.process.stdin.flush()
        progress = []
        while isinstance(answer := read_answer(self.process.stdout.readline()), Progress):
            progress.append(answer)
        return progress, answer


@pytest.fixture(scope="module")
def child(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Child]:
    child = Child(tmp_path_factory.mktemp("program"))
    yield child
    out, err = child.process.communicate(timeout=60)  # the end of the input ends the program
    assert child.process.returncode == 0
    assert out == b""
    assert b"not an answer either" in err


def renamed(request: Request, **changes: Any) -> bytes:
    return request.model_copy(update=changes).line()


def test_a_request_is_rendered_into_files_of_the_exact_size(child: Child, make_request: Any) -> None:
    request = make_request(channels=("depth", "normal"))
    progress, answer = child.ask(request.line())
    assert isinstance(answer, Result)
    assert progress[-1].progress == 1
    assert answer.number == request.number
    assert answer.notes == ("a note",)
    assert answer.load_s > 0
    assert set(answer.files) == set(request.kinds)
    for kind in request.kinds:
        assert (child.folder / request.file_name(kind)).stat().st_size == request.file_bytes(kind)
    radiance = np.fromfile(child.folder / "1-radiance.f32", "<f4")
    assert set(np.unique(radiance).tolist()) <= {0.0, 0.5}
    assert 0.5 in radiance


def test_the_objects_have_the_names_of_the_file_or_of_the_scene(child: Child, make_request: Any) -> None:
    _, answer = child.ask(renamed(make_request(channels=("object",)), bundle="/named"))
    assert isinstance(answer, Result)
    assert answer.objects == ("big üball", "x" * 60, "ball2")
    _, answer = child.ask(renamed(make_request(), bundle="/named"))
    assert isinstance(answer, Result)
    assert answer.objects == ()


def test_channels_alone_have_the_numbers_that_come_with_light(child: Child, make_request: Any) -> None:
    found: list[list[bytes]] = []
    kinds = ("distance", "normal")
    for light in (True, False):
        request = make_request(channels=("depth", "normal"), samples=2)
        _, answer = child.ask(renamed(request, bundle="/named", light=light))
        assert isinstance(answer, Result)
        assert set(answer.files) == ({*kinds, "radiance"} if light else {*kinds})
        found.append([(child.folder / name).read_bytes() for kind, name in answer.files.items() if kind in kinds])
    assert found[0] == found[1]


def test_the_scene_stays_for_the_next_request_of_the_same_frame(child: Child, make_request: Any) -> None:
    request = make_request()
    child.ask(request.line())
    _, kept = child.ask(renamed(request, number=2, region=(3, 9, 0, 8)))
    assert isinstance(kept, Result)
    assert kept.load_s == 0
    assert (child.folder / "1-radiance.f32").stat().st_size == 6 * 8 * 3 * 4  # the file before is replaced
    _, other = child.ask(renamed(request, frame=2))
    assert isinstance(other, Result)
    assert other.load_s > 0


def test_a_scene_that_reads_neither_clock_nor_stage_stays_for_all_frames(child: Child, make_request: Any) -> None:
    request = make_request()
    away = request.job.stage.model_copy(update={"location": (0.0, 0.0, 700.0)})
    for bundle, stays in (("/still", [0, 0]), ("/staged", [0, 1])):
        child.ask(renamed(request, bundle=bundle))
        later = renamed(request, bundle=bundle, frame=2)
        elsewhere = renamed(request, bundle=bundle, job=request.job.model_copy(update={"stage": away}))
        answers = [child.ask(line)[1] for line in (later, elsewhere)]
        assert [int(answer.load_s > 0) for answer in answers if isinstance(answer, Result)] == stays


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"bundle": "/bad"}, "scene", "The file a.ply is missing."),
        ({"bundle": "/broken"}, "scene", "The scene cannot be loaded: vertex 3 is not a number"),
        ({"bundle": "/bug"}, "internal", "KeyError: 'bug'"),
        ({"bundle": "/grown", "channels": ("motion",)}, "unsupported", "needs the same shapes in the next frame"),
    ],
)
def test_a_failure_is_answered_by_its_kind_and_the_next_request_is_rendered(
    child: Child, make_request: Any, changes: dict[str, Any], kind: str, message: str
) -> None:
    request = make_request()
    if "channels" in changes:
        changes = {**changes, "next_job": request.job}
    _, answer = child.ask(renamed(request, number=9, **changes))
    assert isinstance(answer, Failure)
    assert (answer.number, answer.error.kind) == (9, kind)
    assert message in answer.error.message
    assert isinstance(child.ask(make_request().line())[1], Result)


@pytest.mark.parametrize("line", [b"\n", b"{}\n", b"\xff\n", b"[1, 2]\n"])
def test_a_line_that_is_no_request_is_answered_without_a_number(child: Child, line: bytes) -> None:
    _, answer = child.ask(line)
    assert isinstance(answer, Failure)
    assert answer.number is None
    assert answer.error.kind == "unsupported"


TRIANGLE = """v -400 -400 0
v 400 -400 0
v 0 600 0
f 1 2 3
"""


def rendered_alone(folder: Path, variant: str, request: Request) -> NDArray[np.float32]:
    """Return the distances of a scene that the program loads from a bundle, as it is started by a worker."""
    bundle = folder / "bundle"
    bundle.mkdir()
    (bundle / "scene.obj").write_text(TRIANGLE)
    job = request.job.model_copy(update={"file": "scene.obj"})
    asked = request.model_copy(update={"job": job, "bundle": str(bundle)})
    program = [sys.executable, "-m", "worker.engines.mitsuba.inside.program", variant, "1"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[6])}
    ended = subprocess.run(program, input=asked.line(), capture_output=True, cwd=folder, env=environment, check=True)
    answer = read_answer(ended.stdout.splitlines()[-1])
    assert isinstance(answer, Result), answer
    assert np.fromfile(folder / "1-radiance.f32", "<f4").max() > 0
    return np.fromfile(folder / "1-distance.f32", "<f4")


def test_the_program_alone_loads_a_bundle(tmp_path: Path, make_request: Any) -> None:
    distance = rendered_alone(tmp_path, "llvm_ad_rgb", make_request(channels=("depth",)))
    assert np.nanmin(distance) >= 500  # mm: the triangle is square to the axis
    assert np.isfinite(distance).mean() > 0.5


@pytest.mark.skipif(not Path("/dev/nvidiactl").exists(), reason="needs a GPU of NVIDIA: cuda_ad_rgb is not tested here")
def test_a_gpu_measures_the_same_distances(tmp_path: Path, make_request: Any) -> None:
    distances = {}
    for variant in ("llvm_ad_rgb", "cuda_ad_rgb"):
        folder = tmp_path / variant
        folder.mkdir()
        distances[variant] = rendered_alone(folder, variant, make_request(channels=("depth",)))
    assert np.allclose(distances["cuda_ad_rgb"], distances["llvm_ad_rgb"], atol=0.01, equal_nan=True)
