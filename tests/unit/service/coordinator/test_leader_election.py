"""Two candidates on one database: at no time do both believe that they lead."""

from __future__ import annotations

import os
import subprocess
import time

import pytest

from service.coordinator.leader_election import LeaderElection
from service.db import coordinator as coordinator_rows
from service.errors import NotLeading
from tests.builders_service import T0, Farm

TTL_S = 10.0


class Candidates:
    """Two candidates with one clock that the test moves."""

    def __init__(self, farm: Farm) -> None:
        self.passed_s = 0.0
        self.first, self.second = (
            LeaderElection(farm.database, ttl_s=TTL_S, steady=lambda: self.passed_s) for _ in range(2)
        )

    def renew(self, candidate: LeaderElection) -> bool:
        return candidate.renew(now_s=T0 + self.passed_s)


@pytest.fixture
def candidates(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> Candidates:
    monkeypatch.setattr(coordinator_rows, "clock_s", lambda _session, *, local_s: local_s)
    return Candidates(farm)


on_postgresql = pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)


def test_a_leader_that_renews_stays_the_leader(candidates: Candidates) -> None:
    for _ in range(20):
        candidates.passed_s += TTL_S / 4
        assert candidates.renew(candidates.first)
        assert not candidates.renew(candidates.second)


def test_a_silent_leader_stops_believing_before_another_can_win(candidates: Candidates) -> None:
    assert candidates.renew(candidates.first)
    for tenth in range(1, 40):
        candidates.passed_s = tenth * TTL_S / 10
        won = candidates.renew(candidates.second)
        assert not (candidates.first.is_leader and candidates.second.is_leader)
        assert won == candidates.second.is_leader
    assert candidates.second.is_leader


@pytest.mark.parametrize(("part", "leads"), [(0.5, True), (0.95, False), (1.5, False)])
def test_a_leader_believes_for_less_than_its_time_to_live(candidates: Candidates, part: float, leads: bool) -> None:
    candidates.renew(candidates.first)
    candidates.passed_s = part * TTL_S
    assert candidates.first.is_leader is leads


def test_a_leader_that_steps_down_is_replaced_at_once(candidates: Candidates) -> None:
    candidates.renew(candidates.first)
    candidates.first.step_down()
    assert not candidates.first.is_leader
    assert candidates.renew(candidates.second)


def test_a_leader_whose_process_has_died_here_is_replaced_at_once_and_no_other(
    farm: Farm, candidates: Candidates
) -> None:
    ended = subprocess.Popen(["true"])
    ended.wait()
    here = candidates.first.name.removesuffix(f"{os.getpid()}-{candidates.first.name.rpartition('-')[2]}")
    assert here != candidates.first.name
    for name, is_replaced in (
        (f"{here}{ended.pid}-abcdef", True),
        (f"elsewhere-0123456789ab-{ended.pid}-abcdef", False),
    ):
        candidates.first.name = name
        assert candidates.renew(candidates.first)
        assert candidates.renew(candidates.second) is is_replaced
        candidates.second.step_down()


def test_a_leader_renews_before_its_time_and_not_at_every_look(candidates: Candidates) -> None:
    found = [candidates.first.is_due]
    candidates.renew(candidates.first)
    for candidates.passed_s in (0.0, TTL_S / 4):
        found += [candidates.first.is_due, candidates.first.is_leader]
    assert found == [True, False, True, True, True]


def test_a_candidate_that_looks_does_not_wait_for_the_writer(farm: Farm, candidates: Candidates) -> None:
    candidates.renew(candidates.first)
    with farm.writing():
        assert not candidates.renew(candidates.second)


def test_what_a_process_writes_that_was_stopped_and_replaced_is_refused(farm: Farm, candidates: Candidates) -> None:
    guarded = farm.database.guarded(candidates.first.prove)
    candidates.renew(candidates.first)
    with guarded.writing() as session:
        coordinator_rows.add_idle(session, 1.0)
    candidates.passed_s = 2 * TTL_S
    assert candidates.renew(candidates.second)
    candidates.passed_s = 0.0  # the first one has looked at its clock before it was stopped
    believes = [candidates.first.is_leader]
    with pytest.raises(NotLeading), guarded.writing() as session:
        coordinator_rows.add_idle(session, 1.0)
    assert [*believes, candidates.first.is_leader] == [True, False]
    with farm.database.reading() as session:
        assert coordinator_rows.current(session).idle_s == 1.0


@on_postgresql
def test_the_clocks_of_the_machines_of_candidates_may_differ(farm: Farm) -> None:
    first, second = (LeaderElection(farm.database, ttl_s=TTL_S) for _ in range(2))
    now_s = time.time()
    assert first.renew(now_s=now_s + 3600)
    assert not second.renew(now_s=now_s + 7200)
    with farm.database.reading() as session:
        assert coordinator_rows.current(session).leader_until_s < now_s + 1800
        assert coordinator_rows.leader(session, now_s=now_s + 7200) == first.name
