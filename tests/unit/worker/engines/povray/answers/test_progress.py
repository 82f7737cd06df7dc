"""POV-Ray's progress, from lines that it really printed."""

from __future__ import annotations

from itertools import accumulate, pairwise

import pytest

from worker.engines.povray.answers.progress import Phase, PovrayProgressReader, Progress, advance, is_progress

PLAIN = """\
==== [Parsing...] ==========================================================
Parsing 14273K tokens
Parsing 28496K tokens
==== [Rendering...] ========================================================
Rendered 1024 of 3072 pixels (33%)
Rendered 2048 of 3072 pixels (66%)
Rendered 2560 of 3072 pixels (83%)
Rendered 3072 of 3072 pixels (100%)
  Photon Time:      No photons
  Radiosity Time:   No radiosity
""".splitlines()

PHOTONS = """\
==== [Rendering...] ========================================================
Photon count 1949402
Photon count 3538202
Rendered 1024 of 3072 pixels (33%)
Rendered 3072 of 3072 pixels (100%)
  Photon Time:      0 hours  0 minutes  8 seconds (8.047 seconds)
  Radiosity Time:   No radiosity
""".splitlines()

RADIOSITY = """\
==== [Rendering...] ========================================================
Rendered 12 of 76800 pixels (0%)
Rendered 24 of 76800 pixels (0%)
Rendered 12927 of 76800 pixels (16%)
Rendered 76765 of 76800 pixels (99%)
Rendered 1024 of 76800 pixels (1%)
Rendered 38912 of 76800 pixels (50%)
Rendered 76800 of 76800 pixels (100%)
  Radiosity Time:   0 hours  0 minutes  0 seconds (0.060 seconds)
""".splitlines()


def _after(lines: list[str], first_block_px: int = 1024) -> list[Progress]:
    total_px = max(int(line.split()[3]) for line in lines if line.startswith("Rendered"))
    size = {"first_block_px": first_block_px, "total_px": total_px}
    return list(accumulate(lines, lambda progress, line: advance(progress, line, **size), initial=Progress()))


def test_progress_never_falls_and_reaches_one() -> None:
    for lines in (PLAIN, PHOTONS, RADIOSITY):
        fractions = [progress.fraction for progress in _after(lines)]
        assert all(before <= after for before, after in pairwise(fractions))
        assert fractions[-1] == 1.0


def test_phases_come_in_the_order_of_the_work() -> None:
    assert list(dict.fromkeys(step.phase for step in _after(PLAIN))) == [
        Phase.STARTING,
        Phase.PARSING,
        Phase.PREPARING,
        Phase.RENDERING,
    ]
    assert Phase.PHOTONS in {step.phase for step in _after(PHOTONS)}
    assert [step.phase for step in _after(RADIOSITY)][2:7] == [Phase.PRETRACE] * 4 + [Phase.RENDERING]


def test_photons_and_radiosity_are_seen_where_they_are() -> None:
    seen = [(last.photons, last.radiosity) for last in (_after(lines)[-1] for lines in (PLAIN, PHOTONS, RADIOSITY))]
    assert seen == [(False, False), (True, False), (False, True)]


def test_the_whole_pretrace_is_a_part_of_the_bar() -> None:
    pretraced = [step.fraction for step in _after(RADIOSITY) if step.phase is Phase.PRETRACE]
    assert 0.29 < pretraced[-1] <= 0.3


def test_a_picture_smaller_than_a_block_is_no_pretrace() -> None:
    last = _after(["==== [Rendering...] ====", "Rendered 64 of 64 pixels (100%)"], first_block_px=64)[-1]
    assert (last.phase, last.fraction, last.radiosity) == (Phase.RENDERING, 1.0, False)


def test_work_without_a_fraction_still_counts() -> None:
    parsing = [step.count for step in _after(PLAIN) if step.phase is Phase.PARSING]
    assert parsing == [0, 14273, 28496]


def test_only_progress_is_progress() -> None:
    told = [line for line in (*PLAIN, *PHOTONS) if is_progress(line)]
    assert all(line.startswith(("Parsing ", "Photon count ", "Rendered ")) for line in told)
    assert len(told) == 10


def test_the_reader_follows_the_lines_and_names_those_of_progress() -> None:
    reader = PovrayProgressReader(first_block_px=1024, total_px=3072)
    assert [reader.read(line) for line in PLAIN[:5]] == [False, True, True, False, True]
    assert reader.progress == _after(PLAIN[:5])[-1]


def _growths(*lines: str) -> list[tuple[str, float]]:
    reader = PovrayProgressReader(first_block_px=1024, total_px=3072)
    steps = []
    for line in lines:
        reader.read(line)
        steps.append((reader.phase, reader.growth))
    return steps


def test_neither_tokens_nor_photons_are_growth() -> None:
    parsing = _growths("==== [Parsing...] ====", "Parsing 100K tokens", "Parsing 200K tokens")
    photons = _growths("==== [Rendering...] ====", "Photon count 100", "Photon count 200")
    assert {growth for _, growth in parsing + photons} == {0.0}


def test_a_scene_that_prints_lines_of_progress_neither_grows_without_end_nor_returns_to_a_phase() -> None:
    printed = ["Rendered 1024 of 99 pixels (5%)", "Rendered 9000 of 3072 pixels (5%)", "Rendered 5 of 9000 pixels (5%)"]
    assert {growth for _, growth in _growths("==== [Parsing...] ====", *printed)} == {0.0}
    printed = [
        "Photon count 7",
        "==== [Rendering...] ====",
        "Parsing 100K tokens",
        "Rendered 1024 of 3072 pixels (33%)",
    ]
    steps = _growths("Rendered 2048 of 3072 pixels (66%)", *printed)
    assert set(steps) == {(Phase.RENDERING, 2048 / 3072)}


@pytest.mark.parametrize("number", ["1", "9" * 5000, "\u0663", "-1", "1e9", ""])
@pytest.mark.parametrize(
    "text", ["Rendered {} of 0 pixels", "Rendered 1 of {} pixels", "Parsing {}K tokens", "Photon count {}"]
)
def test_no_number_that_a_scene_prints_stops_the_reader_or_is_a_share_of_the_picture(text: str, number: str) -> None:
    reader = PovrayProgressReader(first_block_px=1024, total_px=3072)
    reader.read(text.format(number))
    assert (reader.growth, reader.progress.count < 10**18) == (0.0, True)
