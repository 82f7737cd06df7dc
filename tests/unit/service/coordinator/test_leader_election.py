"""Two candidates on one database: at no time do both believe that they lead."""

from __future__ import annotations

import os
import subprocess

import pytest

from service.coordinator.leader_election import LeaderElection
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
def candidates(farm: Farm) -> Candidates:
    return Candidates(farm)


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
