"""The cost of a frame of the fish in meshes: Mitsuba, warm and cold, and POV-Ray's ray camera on the same meshes.

Both engines have one thread. Mitsuba renders by the program that runs inside the sandbox, in a process of its own;
POV-Ray renders the texts that a worker writes. CPU seconds are compared, so that ratios hold on a busy machine too.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST, SCENES_FOLDER
from tests.benchmarks.mesh_fish import write_for_povray
from tests.benchmarks.optics import ray_camera_s, spent_s
from tests.builders import small_job
from tests.repository import ROOT
from worker.engines.mitsuba.inside.messages import Progress, Request, Result, read_answer

SCENE = SCENES_FOLDER / "fish-mesh"
VARIANT = "llvm_ad_rgb"
ROUNDS = 3
"""Each picture is rendered so often, after one that warms up, and the least time counts."""

_SERVE = """
import sys
from worker.engines.mitsuba.inside.program import main
main(sys.argv[1], 1)
"""

_PINHOLE = """
import sys, time
from pathlib import Path
import numpy as np
from worker.engines.mitsuba.inside.messages import read_request
from worker.engines.mitsuba.inside.program import prepare
prepare(sys.argv[1], 1)
import mitsuba as mi
from worker.engines.mitsuba.inside.scenes.load import load
from worker.engines.mitsuba.inside.shade import bands, shade_band
from worker.engines.mitsuba.inside.whitted import whitted_radiance

request = read_request(sys.stdin.buffer.read())
scene = load(Path(request.bundle), request.job, 0.0).scene
depth = request.job.spec.render.path_depth

def pinhole(rows):
    # In the front focal point of the paper's lens, with the field of 90 lenses of 1 mm.
    half = np.tan(np.radians(17.04 / 2))
    down = half - (np.arange(rows.start, rows.stop, dtype=np.float32) + 0.5) / request.rows * 2 * half
    across = (np.arange(request.cols, dtype=np.float32) + 0.5) / request.cols * 2 * half - half
    x, y = (part.ravel() for part in np.meshgrid(across, down))
    direction = np.stack([x, y, -np.ones_like(x)])
    direction /= np.linalg.norm(direction, axis=0)
    start = np.array([[0], [60], [1056.56]], dtype=np.float32) + 0 * direction
    ray = mi.Ray3f(mi.Point3f(start), mi.Vector3f(direction))
    return np.array(whitted_radiance(scene, ray, depth, mi.Bool(np.ones(len(x), dtype=bool))))

def cpu_s(work):
    before = time.process_time()
    for rows in bands(request):
        work(rows)
    return time.process_time() - before

def rig(rows):
    shade_band(scene, request, rows)

times = [(cpu_s(pinhole), cpu_s(rig)) for _ in range(int(sys.argv[2]) + 1)][1:]
print(*map(min, zip(*times)))
"""

_PEAK = """
# The maximum of getrusage begins with that of the process which started this one.
(line,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(int(line.split()[1]) / 1024, file=sys.stderr)
"""


def small_ratio(folder: Path) -> str:
    """Return the CPU of Mitsuba against that of POV-Ray's ray camera, 90 x 90 lenses of 8 px."""
    return _ratio(folder, lenses=90, px_per_lens=8, rounds=ROUNDS)


def large_ratio(folder: Path) -> str:
    """Return the CPU of Mitsuba against that of POV-Ray's ray camera, 100 x 100 lenses of 24 px."""
    return _ratio(folder, lenses=100, px_per_lens=24, rounds=1)


def cold_ratio(folder: Path) -> str:
    """Return the CPU of a new process of Mitsuba with one frame against that of POV-Ray, 90 x 90 lenses of 8 px."""
    request = fish(lenses=90, px_per_lens=8)
    povray_s, mitsuba_s = [], []
    for number in range(ROUNDS):
        povray_s.append(_povray_s(folder / str(number), request.job))
        mitsuba_s.append(spent_s(lambda: serve([request], folder)))
    return _words(min(mitsuba_s), min(povray_s))


def pinhole_ratio(folder: Path) -> str:
    """Return the CPU of the paper's optics against that of a pinhole camera with as many pixels, both by Mitsuba."""
    command = [sys.executable, "-c", _PINHOLE, VARIANT, str(ROUNDS)]
    line = fish(lenses=90, px_per_lens=8).line()
    ran = subprocess.run(command, input=line, capture_output=True, check=True)
    pinhole_s, rig_s = map(float, ran.stdout.split())
    return _words(rig_s, pinhole_s)


def peak_mb(folder: Path) -> str:
    """Return the peak memory of the program with a frame of 2400 x 2400 pixels."""
    ran = _run(_SERVE + _PEAK, [fish(lenses=100, px_per_lens=24)], folder)
    return f"{float(ran.stderr.split()[-1]):.0f} MB"


def samples_ratio(folder: Path) -> str:
    """Return the CPU of 16 rays a pixel against that of one, 90 x 90 lenses of 8 px."""
    one, many = (_warm_s(fish(lenses=90, px_per_lens=8, samples=samples), folder, rounds=ROUNDS) for samples in (1, 16))
    return _words(many, one)


def fish(*, lenses: int, px_per_lens: int, samples: int = 1) -> Request:
    """Return the request for frame 1 of the fish in meshes."""
    manifest = parse_scene(read_toml((SCENE / MANIFEST).read_bytes(), field=MANIFEST))
    spec = small_job("fish-mesh", count=(lenses, lenses), px_per_lens=px_per_lens, render={"samples": samples})
    side = lenses * px_per_lens
    return Request(
        number=1,
        job=ResolvedJob.of("bench", spec, manifest, bundle="fish-mesh").at(1),
        frame=1,
        rows=side,
        cols=side,
        region=(0, side, 0, side),
        bundle=str(SCENE),
        out="1",
    )


def serve(requests: Sequence[Request], folder: Path) -> list[Result]:
    """Return the answers of a new program to requests, one after the other."""
    ran = _run(_SERVE, requests, folder)
    answers = [answer for line in ran.stdout.splitlines() if not isinstance(answer := read_answer(line), Progress)]
    results = [answer for answer in answers if isinstance(answer, Result)]
    assert len(results) == len(requests), answers
    return results


def _run(program: str, requests: Sequence[Request], folder: Path) -> subprocess.CompletedProcess[bytes]:
    lines = b"".join(request.line() for request in requests)
    command = [sys.executable, "-c", program, VARIANT]
    # The programs are found from the root of the repository, and files go to the folder.
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, input=lines, capture_output=True, check=True, cwd=folder, env=environment)


def _warm_s(request: Request, folder: Path, *, rounds: int) -> float:
    _, *warm = serve([request] * (rounds + 1), folder)
    return min(result.trace_cpu_s for result in warm)


def _ratio(folder: Path, *, lenses: int, px_per_lens: int, rounds: int) -> str:
    request = fish(lenses=lenses, px_per_lens=px_per_lens)
    povray_s = min(_povray_s(folder / str(number), request.job) for number in range(rounds))
    return _words(_warm_s(request, folder, rounds=rounds), povray_s)


def _povray_s(folder: Path, job: ResolvedJob) -> float:
    folder.mkdir()
    write_for_povray(SCENE, folder / "scene.inc")
    stage = job.stage.model_copy(update={"handedness": "right"})
    sheet = job.model_copy(update={"file": "scene.inc", "parameters": {}, "stage": stage})
    return ray_camera_s(folder / "rays", sheet, scene=folder)


def _words(ours_s: float, theirs_s: float) -> str:
    ratio = f"1/{theirs_s / ours_s:.1f}" if 2 * ours_s < theirs_s else f"{ours_s / theirs_s:.2f}"
    return f"{ratio} ({ours_s:.2f} / {theirs_s:.2f} s)"
