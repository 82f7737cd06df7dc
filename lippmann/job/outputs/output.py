"""What all kinds of output have: a kind, a name, and a short spelling by file name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from lippmann.job.rig import Rig

Name = Annotated[str, Field(min_length=1, max_length=50, pattern=r"^[a-z0-9][a-z0-9_-]*$")]
"""Of a file, without its suffix, or of a folder."""


class OutputOptions(BaseModel):
    """One output of a job.

    A kind's own class says `kind`, a `name` of its own, and its options. What an option says of the file format, it
    says by `suffix` too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """By file suffix, the options that the short spelling `<kind><suffix>` stands for; "" for a folder."""

    IS_VIDEO: ClassVar[bool] = False
    """Whether it is one file for the whole job, to be played; else it is one or more files for every frame."""

    kind: str
    name: Name

    @property
    def suffix(self) -> str:
        """Of its files, as in `.mp4`; empty if it is a folder for every frame."""
        raise NotImplementedError

    @property
    def file_name(self) -> str:
        """What the output is called wherever one is told from the other: its name and suffix."""
        return self.name + self.suffix

    @property
    def depth_option(self) -> str | None:
        """The option that asks for the depth of every pixel (`capture.depth`); None if none does."""
        return None

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse options that do not go with the rig, or with the numbers of the frames; most kinds go with any.

        Raises
        ------
        Misfit
            Naming the option.
        """
