"""Scenes that do their worst in the language of scenes, really rendered in each sandbox."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import worker
from lippmann.errors import RenderFailed, SceneError
from tests.integration.povray.conftest import BALL, Room
from tests.needs import needs_povray
from tests.waiting import until
from worker.engines.povray.answers.progress import Phase
from worker.sandbox.limits import Limits
from worker.sandbox.log import HEAD_BYTES, TAIL_BYTES
from worker.sandbox.sandbox import Sandbox

pytestmark = needs_povray

SECRET = '#debug "the key of the administrator"\n'
"""A secret that a scene which includes it prints."""


@pytest.fixture
def room(sandbox: Sandbox, tmp_path: Path) -> Iterator[Room]:
    """Lend a room beside everything that its scene must not reach, and see that no process of it is left."""
    for name in ("admin.key", "lippmann.db", "attempts/other/tile.exr", "bundles/other/a.inc", "task", "bundle"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir() if "." not in name else path.write_text(SECRET)
    room = Room(tmp_path / "task", tmp_path / "bundle", sandbox)
    yield room
    until(lambda: not room.processes())


INCLUDE = '#include "{}"\n'
READ = '#fopen F "{}" read #read (F, A)\n'
PICTURE = '#declare P = pigment {{ image_map {{ exr "{}" }} }}\n'
READS = {
    "the key": ("{outside}/admin.key", INCLUDE),
    "the database": ("{outside}/lippmann.db", READ),
    "a picture of another job": ("{outside}/attempts/other/tile.exr", PICTURE),
    "the bundle of another": ("{outside}/bundles/other/a.inc", INCLUDE),
    "a file by a path that climbs": ("../bundles/other/a.inc", INCLUDE),
    "the environment": ("/proc/self/environ", INCLUDE),
    "the list of users as a font": ("/etc/passwd", 'text {{ ttf "{}" "a" 1, 0 }}\n'),
    "our source": (str(Path(worker.__file__)), INCLUDE),
}  # fmt: skip


@pytest.mark.promise("Scenes", "A scene reads nothing of other scenes, jobs and owners, and nothing of ours.")
@pytest.mark.parametrize("what", READS)
def test_a_scene_reads_nothing_of_others(room: Room, what: str) -> None:
    path, way = READS[what]
    path = path.format(outside=room.bundle.parent)
    with pytest.raises(SceneError) as refused:
        room.render(way.format(path) + BALL)
    assert "no file '" in refused.value.message
    assert "administrator" not in room.log.read_text().replace("\n", "")


FILLS = {
    "bytes": ('#fopen F "big" write #while (1) #write (F, "{}") #end\n'.format("0" * 200), "MB; the limit is 4 MB"),
    "files": (
        '#declare N = 0; #while (1) #declare N = N + 1; #fopen F concat("f", str(N, 0, 0)) write #fclose F #end\n',
        "more than 200 files",
    ),
}


@pytest.mark.promise("Scenes", "A scene that fills its folder with bytes or files ends its own task.")
@pytest.mark.parametrize("kind", FILLS)
def test_a_scene_that_fills_its_folder_ends_its_own_task(room: Room, kind: str) -> None:
    scene, message = FILLS[kind]
    with pytest.raises(RenderFailed, match=message):
        room.render(scene, limits=Limits(cpu_s=60, memory_mb=1024, disk_mb=4, files=200))


@pytest.mark.promise("Scenes", "A scene finds no memory to fill beside its folder.")
@pytest.mark.parametrize("path", ["/fill", "/dev/fill", "/dev/shm/fill", "/tmp/fill"])
def test_a_scene_finds_no_memory_to_fill_beside_its_folder(room: Room, path: str) -> None:
    with pytest.raises(SceneError, match="Cannot open user file"):
        room.render(f'#fopen F "{path}" write #write (F, "out") #fclose F\n{BALL}')
    assert not Path(path).exists()


@pytest.mark.promise("Scenes", "Settings files that a scene brings are not read.")
def test_settings_files_that_a_bundle_or_a_scene_brings_are_not_read(room: Room) -> None:
    for folder in (room.bundle, room.task_dir):
        (folder / "povray.ini").write_text("Declare=Evil=1\nPre_Scene_Command=touch pwned\n")
    room.render(f'#ifdef (Evil) #error "the file was read" #end\n{BALL}')
    assert not [path for folder in (room.bundle, room.task_dir) for path in folder.rglob("pwned")]


FAKES = (
    "Rendered 1 of 0 pixels",
    "Rendered -5 of 9 pixels",
    "Rendered 3072 of 3072 pixels (100%)",
    "Parsing 9K tokens",
)


@pytest.mark.promise("Scenes", "Progress that a scene prints ends nothing and finishes nothing.")
def test_progress_that_a_scene_prints_ends_nothing_and_finishes_nothing(room: Room) -> None:
    room.render("".join(f'#debug "\\n{line}\\n"\n' for line in FAKES) + BALL)
    assert all(0 <= progress.fraction <= 1 for progress in room.heard)
    assert room.heard[-1].phase is Phase.RENDERING
    assert (room.task_dir / "tile.exr").stat().st_size > 1000


@pytest.mark.promise("Scenes", "A flood of text fills neither the log nor the worker.")
def test_a_flood_of_text_fills_neither_the_log_nor_the_worker(room: Room) -> None:
    line = '#debug "{}\\n"'.format("flood " * 30)
    room.render(f"#declare N = 0; #while (N < 30000) {line} #declare N = N + 1; #end\n{BALL}")
    assert room.log.stat().st_size < HEAD_BYTES + TAIL_BYTES + 1000 < 30_000 * 180


def test_a_recursion_without_end_is_refused(room: Room) -> None:
    with pytest.raises(SceneError):
        room.render("#macro Again(N) Again(N + 1) #end\nAgain(1)\n")
