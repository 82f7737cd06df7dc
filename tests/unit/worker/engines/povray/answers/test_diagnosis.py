"""The table of answers. The texts are what POV-Ray, bwrap, Landlock and prlimit really said."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import (
    DiskFull,
    LippmannError,
    OutOfMemory,
    ParseTimedOut,
    Permanent,
    PhotonsTimedOut,
    PovrayMissing,
    RenderCrashed,
    RenderFailed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    SceneError,
    Stopped,
    StoreFull,
    Transient,
)
from worker.engines.povray.answers.diagnosis import Case, diagnose, is_startup_fault
from worker.engines.povray.answers.progress import Phase, Progress
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.process import Outcome

PARSER_GAVE_UP = "Fatal error in parser: Cannot parse input.\nRender failed\n"


def _outcome(
    code: int, said: str = "", *, phase: Phase = Phase.PARSING, ending: Ending = Ending.EXITED
) -> Outcome[Progress]:
    return Outcome(
        ending=ending,
        exit_code=code,
        lines=tuple(said.splitlines()),
        progress=Progress(phase=phase, fraction=0.5),
        wall_s=12.0,
        cpu_s=11.0,
        peak_memory_mb=100.0,
    )


TIMES = TimeLimits(
    total=TimeLimit(12.0, "render.timeout_s of the job"),
    stall=TimeLimit(7.0, "render.stall_s of the job"),
    phases={
        Phase.PARSING: TimeLimit(5.0, "render.parse_timeout_s of the job"),
        Phase.PHOTONS: TimeLimit(6.0, "LIPPMANN_PHOTONS_TIMEOUT_S of the worker"),
    },
)


def _diagnosed(outcome: Outcome[Progress], *, free_bytes: int = 10**9) -> LippmannError | None:
    limits = Limits(cpu_s=60, memory_mb=512, file_mb=20)
    return diagnose(Case(outcome, limits, TIMES, (Path("/scratch/bundle"),), free_bytes))


ANSWERS = {
    "stopped": (_outcome(2, ending=Ending.STOPPED), Stopped, "stop"),
    "timeout": (
        _outcome(2, ending=Ending.TIMED_OUT),
        RenderTimedOut,
        "after 12 s, the limit that render.timeout_s of the job gives; parsing at 50 %",
    ),
    "stall": (
        _outcome(-9, ending=Ending.STALLED),
        RenderStalled,
        "no progress for 7 s, the limit that render.stall_s of the job gives",
    ),
    "endless parsing": (
        _outcome(2, ending=Ending.PHASE_TIMED_OUT),
        ParseTimedOut,
        "parsed the scene for 5 s, the limit that render.parse_timeout_s of the job gives",
    ),
    "endless photons": (
        _outcome(2, ending=Ending.PHASE_TIMED_OUT, phase=Phase.PHOTONS),
        PhotonsTimedOut,
        "shot photons for 6 s, the limit that LIPPMANN_PHOTONS_TIMEOUT_S of the worker gives",
    ),
    "parse error": (
        _outcome(
            1,
            "File '/scratch/bundle/scene.inc' line 3: Parse Error: No matching } in\n 'sphere', plane found instead\n"
            + PARSER_GAVE_UP,
        ),
        SceneError,
        "scene.inc line 3: No matching } in 'sphere', plane found instead",
    ),
    "missing include": (
        _outcome(
            1,
            "File 'a.pov' line 2: Possible Parse Error: Cannot find file\n"
            " 'nowhere_to_be_found.inc', even after trying to append file type extension.\n"
            "File 'a.pov' line 2: Parse Error: Cannot open include file\n nowhere_to_be_found.inc.\n" + PARSER_GAVE_UP,
        ),
        SceneError,
        "a.pov line 2: no file 'nowhere_to_be_found.inc' in the scene bundle",
    ),
    "missing picture": (
        _outcome(
            1,
            "File 'a.pov' line 2: Possible Parse Error: Cannot find file\n"
            " 'textures/missing_picture.png', even after trying to append file type\n extension.\n"
            "File 'a.pov' line 2: Possible Parse Error: Cannot find image file.\n"
            "Fatal error in parser: Cannot open file.\nRender failed\n",
        ),
        SceneError,
        "a.pov line 2: no file 'textures/missing_picture.png' in the scene bundle",
    ),
    "an error elsewhere after a missing file": (
        _outcome(
            1,
            "File 'a.pov' line 2: Possible Parse Error: Cannot find file 'x', even after trying.\n"
            "File 'a.pov' line 9: Parse Error: Array subscript out of range\n" + PARSER_GAVE_UP,
        ),
        SceneError,
        "a.pov line 9: Array subscript out of range",
    ),
    "broken picture": (
        _outcome(
            1,
            "File 'badpng.pov' line 2: Possible Parse Error: Cannot read PNG data\n"
            "Fatal error in parser: Cannot access data in file.\nRender failed\n",
        ),
        SceneError,
        "badpng.pov line 2: Cannot read PNG data",
    ),
    "our own file gone": (
        _outcome(
            1,
            "Possible Parse Error: Cannot find file 'noscene.pov', even after trying to\n append file type extension.\n"
            "Parse Error: Cannot open input file.\n" + PARSER_GAVE_UP,
        ),
        RenderFailed,
        "the .pov that the worker wrote",
    ),
    "memory in an array": (
        _outcome(1, "File 'hog.pov' line 2: Parse Error: std::bad_alloc\n" + PARSER_GAVE_UP),
        OutOfMemory,
        "out of memory: 100 MB resident at most, limit 512 MB",
    ),
    "memory in objects": (_outcome(1, "\n" + PARSER_GAVE_UP), OutOfMemory, "out of memory"),
    "memory in photons": (
        _outcome(1, "Fatal error in renderer: Out of memory.\nRender failed\n", phase=Phase.PHOTONS),
        OutOfMemory,
        "out of memory",
    ),
    "disk full": (
        _outcome(
            1,
            "Cannot access data in file.\nFatal error in renderer: Frontend halted render.\n",
            phase=Phase.RENDERING,
        ),
        DiskFull,
        "no room",
    ),
    "folder not writable": (
        _outcome(1, "Cannot create render state output file.\n\nRender failed\n"),
        RenderFailed,
        "could not create its files",
    ),
    "option refused": (
        _outcome(1, "Problem with option setting\npovray +QQ\nFailed to parse command-line option\n"),
        RenderFailed,
        "Failed to parse command-line option",
    ),
    "somebody's SIGTERM": (_outcome(2, "Render cancelled by user\n"), RenderFailed, "signal from outside"),
    "CPU limit": (_outcome(128 + 24), RenderTimedOut, "60 s of CPU"),
    "file size limit": (_outcome(-25), RenderCrashed, "SIGXFSZ: it wrote a file of more than 20 MB"),
    "killed": (_outcome(137), RenderCrashed, "SIGKILL: most often the machine is out of memory"),
    "crash": (_outcome(-11, "last words\n"), RenderCrashed, "SIGSEGV: last words"),
    "no threads": (
        _outcome(134, "  what():  boost::thread_resource_error: Resource temporarily unavailable\n"),
        RenderCrashed,
        "SIGABRT",
    ),
    "enter": (
        _outcome(127, "enter: 1: exec: bwrap: not found\n", phase=Phase.STARTING),
        SandboxMissing,
        "The sandbox did not start: enter: 1: exec: bwrap: not found",
    ),
    "bwrap": (
        _outcome(1, "bwrap: Can't find source path /nope: No such file or directory\n", phase=Phase.STARTING),
        SandboxMissing,
        "source path /nope",
    ),
    "landlock": (
        _outcome(125, "landlock: [Errno 38] this kernel has no Landlock (ENOSYS)\n", phase=Phase.STARTING),
        SandboxMissing,
        "no Landlock",
    ),
    "povray gone": (
        _outcome(127, "prlimit: failed to execute povrayx: No such file or directory\n", phase=Phase.STARTING),
        PovrayMissing,
        "povrayx",
    ),
    "start-up fault": (
        _outcome(1, "Timed out waiting for worker thread startup\n", phase=Phase.STARTING),
        RenderFailed,
        "again and again",
    ),
    "anything else": (_outcome(77, "strange\n\nRender failed\n"), RenderFailed, "ended with 77: strange"),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_becomes_its_error(name: str) -> None:
    outcome, family, message = ANSWERS[name]
    error = _diagnosed(outcome)
    assert type(error) is family
    assert message in error.message


def test_only_the_scene_is_at_fault_for_good() -> None:
    for outcome, family, _ in ANSWERS.values():
        error = _diagnosed(outcome)
        assert isinstance(error, Permanent if family is SceneError else Transient)


def test_a_good_end_is_no_error() -> None:
    assert _diagnosed(_outcome(0, phase=Phase.RENDERING)) is None


def test_a_failure_on_a_full_disk_is_the_disks() -> None:
    assert isinstance(_diagnosed(_outcome(1, PARSER_GAVE_UP), free_bytes=100), StoreFull)


def test_a_scene_that_says_the_words_of_a_start_up_fault_is_not_started_again() -> None:
    words = "Timed out waiting for worker thread startup\n"
    assert is_startup_fault(_outcome(1, words, phase=Phase.STARTING))
    assert not is_startup_fault(_outcome(1, words, phase=Phase.PARSING))
    assert not is_startup_fault(_outcome(1, words, phase=Phase.STARTING, ending=Ending.STOPPED))
