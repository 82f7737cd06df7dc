import pytest

from lippmann.terminal.progress import LINE_EVERY_S, ProgressLine, duration_text, size_text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "0 s"),
        (0.2, "1 s"),
        (59.5, "1 min 00 s"),
        (3599, "59 min 59 s"),
        (3600, "1 h 00 min"),
        (100 * 3600, "4 days"),
        (None, "?"),
    ],
)
def test_a_time_to_go_is_said_in_two_units_at_most(seconds: float | None, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.parametrize(("count", "text"), [(0, "0 B"), (1000, "1.0 kB"), (2.5e9, "2.5 GB"), (3e15, "3000.0 TB")])
def test_bytes_are_said_in_the_unit_that_fits(count: float, text: str) -> None:
    assert size_text(count) == text


class _Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_pipe_gets_a_line_every_few_seconds_and_news_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    clock = _Clock()
    with ProgressLine("job", clock=clock) as line:
        line.show(0.0, "begins")
        line.show(0.1, "too soon")
        line.show(0.2, "news", news=True)
        line.show(0.2, "news", news=True)  # said already
        clock.now += LINE_EVERY_S
        line.show(0.3, "in time")
    said = capsys.readouterr()
    assert said.err.splitlines() == ["job:   0% begins", "job:  20% news", "job:  30% in time"]
    assert said.out == ""
