"""The answer to one request, read from the lines of the program inside the sandbox."""

from __future__ import annotations

from worker.engines.mitsuba.inside.messages import Failure, Progress, Result, read_answer


class AnswerReader:
    """Reads the lines that follow a request; nothing is read after its answer.

    A line that is no message is a word for the log: Mitsuba and LLVM say what they want to.
    """

    phase = "rendering"

    def __init__(self, number: int) -> None:
        self.progress = 0.0
        self.answer: Result | Failure | None = None
        self._number = number

    @property
    def growth(self) -> float:
        """The share of the work that is done."""
        return self.progress

    @property
    def has_answer(self) -> bool:
        """True when the answer has been read."""
        return self.answer is not None

    def read(self, line: str) -> bool:
        """Update the progress or the answer; return whether the line is such a message."""
        if self.has_answer or not line.startswith("{"):
            return False
        try:
            message = read_answer(line.encode())
        except ValueError:
            return False
        if isinstance(message, Progress):
            self.progress = max(self.progress, message.progress)
        elif message.number in (self._number, None):
            self.answer = message
        else:
            return False
        return True
