"""However a render ends, nothing of it is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import (
    LippmannError,
    OutOfMemory,
    ParseTimedOut,
    PhotonsTimedOut,
    RenderFailed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    SceneError,
    Stopped,
)
from tests.integration.povray.conftest import BALL, ENDLESS_PARSE, ENDLESS_TRACE, HEAD, Room, times_of
from tests.waiting import until
from worker.engines.povray.answers.progress import Phase, PovrayProgressReader, Progress
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome, run

WORKER = """
import sys
from pathlib import Path
from tests.integration.povray.conftest import Room
from worker.sandbox.sandbox import Sandbox

task_dir, bundle, mode = sys.argv[1:]
room = Room(Path(task_dir), Path(bundle), Sandbox(mode, allow_none=True))
room.render(cols=2000, rows=2000, on_progress=lambda progress: print(progress.phase.value, flush=True))
"""


def _ran(room: Room, argv: list[str], timeout_s: float = 300) -> Outcome[Progress]:
    """Run any program as POV-Ray is run."""
    with AttemptLog(room.log, head_bytes=100_000, tail_bytes=100_000) as log:
        return run(
            argv,
            cwd=room.task_dir,
            env={"PATH": "/usr/bin:/bin", "HOME": str(room.task_dir)},
            times=times_of(timeout_s, 60, 60),
            reader=PovrayProgressReader(first_block_px=1024, total_px=3072),
            on_progress=room.heard.append,
            should_stop=lambda: False,
            log=log,
        )


SCENES = {Phase.PARSING: ENDLESS_PARSE, Phase.RENDERING: ENDLESS_TRACE}


@pytest.mark.parametrize("phase", SCENES)
def test_when_the_worker_is_killed_povray_dies(room: Room, phase: Phase) -> None:
    room.write(SCENES[phase])
    argv = [sys.executable, "-c", WORKER, str(room.task_dir), str(room.bundle), room.sandbox.mode]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as worker:
        assert worker.stdout is not None
        assert any(line == f"{phase.value}\n" for line in worker.stdout)
        povray = room.povray()
        worker.kill()
        worker.wait()
    until(lambda: not Path(f"/proc/{povray}").exists())
    until(lambda: not room.processes())


@pytest.mark.parametrize("phase", SCENES)
def test_a_told_stop_ends_it(room: Room, phase: Phase) -> None:
    def should_stop() -> bool:
        return any(progress.phase is phase for progress in room.heard)

    with pytest.raises(Stopped):
        room.render(SCENES[phase], cols=2000, rows=2000, should_stop=should_stop)
    assert not room.processes()


def test_a_run_over_its_time_is_ended(room: Room) -> None:
    with pytest.raises(RenderTimedOut, match="parsing"):
        room.render(ENDLESS_PARSE, timeout_s=3)
    assert not room.processes()


def test_a_run_without_progress_is_ended_even_if_it_does_not_listen(room: Room) -> None:
    def freeze(progress: Progress) -> None:
        if progress.phase is Phase.RENDERING:
            os.kill(room.povray(), signal.SIGSTOP)

    with pytest.raises(RenderStalled):
        room.render(ENDLESS_TRACE, cols=2000, rows=2000, stall_s=3, on_progress=freeze)
    assert not room.processes()


PHOTON_STORM = """global_settings { photons { spacing 0.00002 } }
sphere { 0, 1 pigment { rgbt <1, 0.5, 0.2, 0.9> } interior { ior 1.5 }
  photons { target refraction on reflection on } }
"""
SAYS = '#while (1) #debug "{}" #end\n'
"""A scene that parses without end, and prints lines as POV-Ray does."""

ENDLESS: dict[str, tuple[str, type[LippmannError], dict[str, float]]] = {
    "a loop": (ENDLESS_PARSE, ParseTimedOut, {"phase_s": 3}),
    "a recursion": ("#macro Again(N) Again(N + 1) #end\nAgain(1)\n", SceneError, {}),
    "photons": (PHOTON_STORM, PhotonsTimedOut, {"phase_s": 3}),
    "a loop that prints tokens": (SAYS.format("Parsing 7K tokens\\n"), ParseTimedOut, {"phase_s": 3}),
    "a loop that prints photons": (SAYS.format("Photon count 7\\n"), PhotonsTimedOut, {"phase_s": 3}),
    "a loop that prints blocks": (SAYS.format("Rendered 1024 of 3072 pixels (33%)\\n"), RenderStalled, {"stall_s": 3}),
    "a loop that prints other blocks": (SAYS.format("Rendered 5 of 9 pixels (5%)\\n"), ParseTimedOut, {"phase_s": 3}),
    "a loop that prints more and more blocks": (
        "#declare N = 0; #while (1) #declare N = N + 1;"
        ' #debug concat("Rendered ", str(N, 0, 0), " of 3072 pixels (1%)\\n") #end\n',
        RenderStalled,
        {"stall_s": 3},
    ),
}


@pytest.mark.parametrize("name", ENDLESS)
def test_endless_work_ends_at_its_limit(best: Room, name: str) -> None:
    scene, error, limit = ENDLESS[name]
    with pytest.raises(error) as ended:
        best.render(scene, **limit)
    assert type(ended.value) is error
    assert "3 s, the limit that" in ended.value.message or not limit


def test_an_error_of_the_caller_leaves_nothing(room: Room) -> None:
    def fail(progress: Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        room.render(ENDLESS_PARSE, on_progress=fail)
    assert not room.processes()


def test_a_stopped_run_still_counts_its_seconds(room: Room) -> None:
    room.write(ENDLESS_PARSE)
    argv = room.sandbox.wrap(
        ["povray", "+Itile.pov", "-D", "+V"],
        readable=[],
        writable=room.task_dir,
        limits=Limits(cpu_s=60, memory_mb=1024),
    )
    outcome = _ran(room, argv, timeout_s=4)
    assert outcome.ending is Ending.TIMED_OUT
    assert outcome.exit_code in (2, 137, -9), "POV-Ray listens to SIGTERM within the grace, or is killed after it"
    assert 0.3 < outcome.cpu_s < outcome.wall_s + 0.5


def test_memory_has_a_limit(held: Room) -> None:
    hog = "#declare I = 0; union { #while (I < 1e9) sphere { I, 1 } #declare I = I + 1; #end }\n"
    with pytest.raises(OutOfMemory, match=r"out of memory: .* limit 200 MB"):
        held.render(hog, limits=Limits(cpu_s=60, memory_mb=200))
    hog = "#declare A = array[100000000]; #declare A[3] = 3;\n"
    with pytest.raises(OutOfMemory, match="out of memory"):
        held.render(hog, limits=Limits(cpu_s=60, memory_mb=200))


def test_cpu_seconds_have_a_limit(room: Room) -> None:
    with pytest.raises(RenderTimedOut, match="1 s of CPU"):
        room.render(ENDLESS_PARSE, limits=Limits(cpu_s=1, memory_mb=1024))


def test_a_file_has_a_largest_size(room: Room) -> None:
    runaway = '#fopen F "big.txt" write #while (1) #write (F, "0123456789012345678901234567890123456789") #end\n'
    with pytest.raises(RenderFailed, match="file of more than 1 MB"):
        room.render(runaway, limits=Limits(cpu_s=60, memory_mb=1024, file_mb=1))


REFUSED = {
    "a bracket": ("sphere { 0, 1\nplane { y, 0 }\n", "tile.pov line 4: No matching } in 'sphere', plane found instead"),
    "a name": (
        '#include "deep.inc"\nMissing_Brace\n',
        "textures/../deep.inc line 2: Expected 'numeric expression', undeclared identifier 'Nope' found instead",
    ),
    "an include file": (
        '#include "nowhere_to_be_found.inc"\n',
        "tile.pov line 3: no file 'nowhere_to_be_found.inc' in the scene bundle",
    ),
    "a picture": (
        'sphere { 0, 1 pigment { image_map { png "textures/missing_picture.png" } } }\n',
        "tile.pov line 3: no file 'textures/missing_picture.png' in the scene bundle",
    ),
    "a broken picture": (
        'sphere { 0, 1 pigment { image_map { png "broken.png" } } }\n',
        "tile.pov line 3: Not a PNG file",
    ),
    "a font": (
        'text { ttf "nowhere.ttf" "A" 1, 0 }\n',
        "tile.pov line 3: no file 'nowhere.ttf' in the scene bundle",
    ),
    "the author": (
        '#error "this cannot be, and it is said at such a length that it wraps at eighty columns"\n',
        "tile.pov line 3: Parse halted by #error directive: this cannot be, and it is said at such a length that it "
        "wraps at eighty columns",
    ),
    "an array": (
        "#declare A = array[3];\n#declare B = A[5];\n",
        "tile.pov line 4: Array subscript out of range",
    ),
    "itself": ('#include "tile.pov"\n', "tile.pov line 3: Too many nested include files."),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_scene_that_is_refused_is_told_with_file_and_line(best: Room, name: str) -> None:
    scene, message = REFUSED[name]
    (best.bundle / "deep.inc").write_text("// one\nsphere { 0, Nope }\n")
    (best.bundle / "broken.png").write_text("no picture")
    with pytest.raises(SceneError) as refused:
        best.render(scene)
    assert refused.value.message == message.replace("textures/../", "")


@pytest.mark.parametrize(
    ("script", "code"),
    [
        ("head -c 30000000 /dev/zero; echo; echo end", 0),
        ("yes 'a line that comes again and again' | head -c 30000000; echo; echo end; exit 3", 3),
    ],
)
def test_a_flood_of_output_neither_blocks_nor_fills_the_disk(best: Room, script: str, code: int) -> None:
    outcome = _ran(best, ["/bin/sh", "-c", script])
    assert outcome.exit_code == code
    assert outcome.lines[-1] == "end"
    assert best.log.stat().st_size < 220_000


def test_a_sandbox_that_cannot_be_started_is_missing(best: Room) -> None:
    with pytest.raises(SandboxMissing, match="no-such-bwrap"):
        _ran(best, ["no-such-bwrap"])


def test_what_a_child_leaves_behind_is_ended_with_it(best: Room) -> None:
    outcome = _ran(best, ["/bin/sh", "-c", "sleep 300 & exit 5"])
    assert outcome.exit_code == 5
    assert outcome.wall_s < 300
    until(lambda: not best.processes())


def test_the_head_of_these_scenes_is_two_lines() -> None:
    assert HEAD.count("\n") == 2
    assert BALL.count("\n") == 1
