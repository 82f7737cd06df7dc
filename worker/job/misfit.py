"""Two fields of a job that do not go together: told by the one that has to change."""

from __future__ import annotations


class Misfit(ValueError):
    """What a validator of several fields raises, so that the message names one of them.

    Parameters
    ----------
    field
        From the part that is validated, as in `tiles`.
    """

    def __init__(self, field: str, *, expected: str, got: object) -> None:
        super().__init__(f"{field}: {expected}, got {got}")
        self.field, self.expected, self.got = field, expected, str(got)
