"""The base of all kinds of output, and the registry of the kinds.

A new kind is one module in this package: a model that derives from `OutputOptions` and is registered with
`@output_kind`. Its maker is one module in `worker.tasks.outputs`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import Field

from lippmann.job.fields.model import JobModel
from lippmann.job.optics.rig import Rig

Name = Annotated[
    str,
    Field(
        min_length=1,
        max_length=50,
        pattern=r"^[a-z0-9][a-z0-9_-]*$",
        description="The name of the file without its suffix, or of the folder.",
    ),
]


class OutputOptions(JobModel):
    """One output of a job.

    The class of a kind defines `kind`, a default `name`, and its options. An option that selects the file format also
    selects `suffix`.
    """

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """The options that the short spelling `<kind><suffix>` stands for, by file suffix; the suffix "" is a folder."""

    IS_VIDEO: ClassVar[bool] = False
    """True if the output is one video file for the whole job; otherwise it has one or more files for every frame."""

    kind: str
    name: Name

    @property
    def suffix(self) -> str:
        """The suffix of its files, as in `.mp4`; empty if every frame has a folder."""
        raise NotImplementedError

    @property
    def file_name(self) -> str:
        """The name and suffix, which identify the output among those of its job."""
        return self.name + self.suffix

    @property
    def depth_option(self) -> str | None:
        """The option that requires the depth of every pixel (`capture.depth`); None if the output does not need it."""
        return None

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse options that do not fit the rig or the numbers of the frames; most kinds fit all of them.

        Raises
        ------
        FieldError
            The error names the option.
        """

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse an observer that is too near for the rig at the viewing distance of the job.

        Parameters
        ----------
        rig
            The rig of the job.
        viewing_distance_mm
            The distance of the observer if the output has none: `display.viewing_distance_mm`.

        Raises
        ------
        FieldError
            The error names the option.
        """


KINDS: dict[str, type[OutputOptions]] = {}
"""Every registered kind of output, by its word in job files."""

Kind = TypeVar("Kind", bound=OutputOptions)


def output_kind(options: type[Kind]) -> type[Kind]:
    """Register a kind of output; a class decorator.

    Raises
    ------
    ValueError
        If the class has no kind of its own, or another class has the same kind.
    """
    kind = options.model_fields["kind"].default
    if not isinstance(kind, str) or KINDS.get(kind, options) is not options:
        raise ValueError(f"expected a kind of output of its own, got {kind!r} from {options.__name__}")
    KINDS[kind] = options
    return options
