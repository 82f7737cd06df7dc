"""The handover of slots, from processes that were forked after the pipe was made."""

from __future__ import annotations

import os
import select

from worker.handover import Handover


def announced_by_a_child(handover: Handover, *attempts: str) -> None:
    child = os.fork()
    if child == 0:
        for attempt in attempts:
            handover.announce(attempt)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0


def test_an_attempt_that_announces_its_end_occupies_no_slot() -> None:
    handover = Handover()
    announced_by_a_child(handover, "a1", "a3")
    assert select.select([handover], [], [], 0)[0] == [handover]
    handover.read()
    assert handover.occupied(["a1", "a2", "a3"]) == 1
    assert select.select([handover], [], [], 0)[0] == []


def test_an_announcement_is_forgotten_with_its_attempt() -> None:
    handover = Handover()
    announced_by_a_child(handover, "a1")
    handover.read()
    assert handover.occupied([]) == 0
    assert handover.occupied(["a1"]) == 1


def test_an_announcement_that_is_read_in_two_pieces_counts() -> None:
    handover = Handover()
    os.write(handover._writer, b"a")
    handover.read()
    os.write(handover._writer, b"1\n")
    handover.read()
    assert handover.occupied(["a1"]) == 0


def test_a_pipe_that_nobody_reads_delays_no_attempt() -> None:
    handover = Handover()
    for number in range(10_000):
        handover.announce(f"{number:016}")
    handover.read()
    assert handover.occupied([f"{0:016}", "other"]) == 1
