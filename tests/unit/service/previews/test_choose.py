"""The worker of a preview: the one with the scene, one that fits, and a reason if there is none."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.job.messages.events import Closed, Presence
from lippmann.job.resolved import ResolvedJob
from lippmann.plan.preview import PreviewSize, preview_job
from service.errors import BrokerUnavailable, PreviewUnavailable
from service.previews.choose import choose_worker
from service.roster import Roster
from tests.builders import small_job
from tests.unit.lippmann.plan.test_preview import SCENE


def worker(name: str, **more: Any) -> Presence:
    fields: dict[str, Any] = {
        "host": "h", "pid": 1, "slots": 2, "sandbox": "bwrap", "povray": "3.7", "version": "0", "started_s": 0.0,
        "seen_s": 0.0, "previews": True, "engines": ("povray",),
    }  # fmt: skip
    return Presence.model_validate(fields | {"name": name} | more)


def job(owner: str = "ann", *, file: str = "scene.inc", bundle: str = "b", **more: Any) -> ResolvedJob:
    manifest = SCENE.model_copy(update={"file": file})
    sheet = ResolvedJob.of("j", small_job("fish", **more), manifest, bundle=bundle, frames=1)
    return preview_job(sheet, frame=1, size=PreviewSize(), owner=owner).job


def roster(*workers: Presence) -> Roster:
    return Roster(workers, {})


def test_a_scene_of_an_owner_stays_with_one_worker_while_others_come_and_go() -> None:
    names = [f"w{number}" for number in range(8)]
    chosen = choose_worker(roster(*map(worker, names)), job())
    for gone in set(names) - {chosen}:
        assert choose_worker(roster(*(worker(name) for name in names if name != gone)), job()) == chosen
    scenes = {choose_worker(roster(*map(worker, names)), job(bundle=str(number))) for number in range(50)}
    assert len(scenes) > 4  # the scenes are spread


def test_a_busy_worker_is_avoided_if_another_can_do_it() -> None:
    two = roster(worker("a"), worker("b"))
    chosen = choose_worker(two, job())
    assert choose_worker(two, job(), busy={chosen}) != chosen
    assert choose_worker(two, job(), busy={"a", "b"}) == chosen


@pytest.mark.parametrize(
    ("workers", "words"),
    [
        ((), "no worker is online"),
        ((worker("a", engines=("povray",)),), "has the engine Mitsuba, which the job needs"),
        ((worker("a", engines=("mitsuba",), previews=False),), "takes orders of previews now"),
        ((worker("a", engines=("mitsuba",), closed=Closed.DRAINING),), "takes orders of previews now"),
    ],
)
def test_the_reason_says_what_is_missing(workers: tuple[Presence, ...], words: str) -> None:
    with pytest.raises(PreviewUnavailable, match=words):
        choose_worker(roster(*workers), job(file="scene.xml"))


def test_without_the_broker_nobody_knows_the_workers() -> None:
    with pytest.raises(BrokerUnavailable):
        choose_worker(None, job())


def test_workers_of_another_pool_render_no_preview() -> None:
    with pytest.raises(PreviewUnavailable, match="the pool night"):
        choose_worker(roster(worker("a")), job(workers={"pool": "night"}))
