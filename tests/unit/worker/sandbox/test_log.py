"""The log of an attempt keeps its beginning and its end."""

from __future__ import annotations

from pathlib import Path

from worker.sandbox.log import AttemptLog


def test_a_short_log_is_kept_whole_and_at_once(tmp_path: Path) -> None:
    log = AttemptLog(tmp_path / "1.txt")
    log.write("one")
    log.write("zwölf")
    assert log.path.read_text() == "one\nzwölf\n"
    log.close()
    assert log.path.read_text() == "one\nzwölf\n"


def test_of_a_long_log_head_and_tail_are_kept_and_the_gap_is_told(tmp_path: Path) -> None:
    with AttemptLog(tmp_path / "1.txt", head_bytes=40, tail_bytes=30) as log:
        for number in range(1000):
            log.write(f"line {number:04}")
    lines = log.path.read_text().splitlines()
    assert lines == ["line 0000", "line 0001", "line 0002", "line 0003", "[... 9930 bytes left out ...]"] + [
        f"line {number:04}" for number in (997, 998, 999)
    ]


def test_no_line_is_lost_when_all_fits_into_head_and_tail(tmp_path: Path) -> None:
    with AttemptLog(tmp_path / "1.txt", head_bytes=25, tail_bytes=1000) as log:
        for number in range(50):
            log.write(f"line {number:04}")
    assert log.path.read_text().splitlines() == [f"line {number:04}" for number in range(50)]
