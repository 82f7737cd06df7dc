"""A warm engine that was taken over finds nothing of others between its requests, and does nothing after its answer."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import service
from tests.security.conftest import RED_TEAM
from tests.unit.worker.engines.mitsuba.conftest import KEY, Room, make_room
from worker.sandbox.sandbox import Sandbox

WARM = Path(__file__).with_name("warm_red_team.py")


@pytest.fixture
def room(sandbox: Sandbox, tmp_path: Path) -> Iterator[Room]:
    """Lend a room for the red team; afterwards no process and no folder of a session is left."""
    with make_room(tmp_path, sandbox, WARM) as made:
        shutil.copy(RED_TEAM, made.bundle)
        yield made


def _attack(room: Room, *words: str) -> list[str]:
    printed: list[str] = json.loads(room.ask(json.dumps(words)).notes[0])
    return printed


@pytest.mark.promise("Scenes", "A warm engine that was taken over finds nothing of an owner whom it served before.")
def test_it_finds_nothing_of_others(room: Room) -> None:
    with room.session(replace(KEY, owner="bert")) as of_another:
        left = of_another.work / "left"
        left.write_text("of Bert")
    secret = room.root / "secret"
    secret.write_text("secret")
    secret.chmod(0o644)
    wanted = [secret, left, left.parent, Path(str(service.__file__)), Path("/etc/passwd"), Path("/var")]
    assert _attack(room, "reads", *map(str, wanted)) == []
    assert not left.exists()
    own = str(room.bundle / "behaviour")
    assert _attack(room, "reads", own) == [own], "the attack works where it may"


def test_it_writes_nothing_outside_its_folder(room: Room) -> None:
    with room.session() as session:
        library = session.folder / "library"
    places = [
        library / "lippmann",
        library / "new",
        session.folder / "new",
        room.bundle / "behaviour",
        room.root / "new",
    ]
    assert _attack(room, "writes", *map(str, places)) == []
    assert "write own" in _attack(room, "writes", "own"), "the attack works where it may"


def test_it_makes_no_socket_of_any_kind(room: Room) -> None:
    assert _attack(room, "sockets") == []


@pytest.mark.promise("Scenes", "After its answer a warm engine does nothing until it is asked again.")
def test_it_does_nothing_after_its_answer(room: Room) -> None:
    room.ask('["keeps_writing"]')
    with room.session() as session:
        late = session.work / "late"
        assert not late.exists()
        time.sleep(0.1)
        assert not late.exists()


def test_no_process_of_it_escapes_its_end(room: Room) -> None:
    room.ask('["escapes_its_end"]')
    assert room.processes()
