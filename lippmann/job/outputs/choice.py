"""All kinds of output as one field of a job.

An output is written as an object, `{"kind": "views", "codec": "ffv1", "name": "lossless"}`, or shortly by the name of
its file, `views.mp4`: the kind, and a suffix that stands for options.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, get_args

from pydantic import BeforeValidator, Tag

from lippmann.job.outputs.clips import FocusVideo, SweepVideo
from lippmann.job.outputs.datasets import HciFolder, LensletVideo, NpzArrays, SubapertureViews
from lippmann.job.outputs.depth import DepthPictures
from lippmann.job.outputs.observer import ObserverPictures, ObserverVideo
from lippmann.job.outputs.output import OutputOptions
from lippmann.job.outputs.pictures import ContactSheet, Epi, Quilt, Sheets, ViewGrid
from lippmann.job.outputs.prints import CalibrationSheet, Print
from lippmann.job.outputs.spoc import Spoc
from lippmann.job.outputs.stereo import AnaglyphVideo, StereoVideo
from lippmann.job.outputs.videos import CentreVideo, IntegralVideo, OrthoscopicVideo, ViewsVideo
from lippmann.job.problems import Misfit, told_by
from lippmann.job.rig import Rig

_Kind = Annotated[
    Annotated[ViewsVideo, Tag("(views)")]
    | Annotated[CentreVideo, Tag("(centre)")]
    | Annotated[OrthoscopicVideo, Tag("(orthoscopic)")]
    | Annotated[ObserverVideo, Tag("(observer)")]
    | Annotated[ObserverPictures, Tag("(observer_pictures)")]
    | Annotated[IntegralVideo, Tag("(integral)")]
    | Annotated[SweepVideo, Tag("(sweep)")]
    | Annotated[FocusVideo, Tag("(focus)")]
    | Annotated[StereoVideo, Tag("(stereo)")]
    | Annotated[AnaglyphVideo, Tag("(anaglyph)")]
    | Annotated[ViewGrid, Tag("(view_grid)")]
    | Annotated[Quilt, Tag("(quilt)")]
    | Annotated[Epi, Tag("(epi)")]
    | Annotated[ContactSheet, Tag("(contact_sheet)")]
    | Annotated[Sheets, Tag("(sheets)")]
    | Annotated[DepthPictures, Tag("(depth)")]
    | Annotated[Spoc, Tag("(spoc)")]
    | Annotated[HciFolder, Tag("(hci)")]
    | Annotated[SubapertureViews, Tag("(subaperture_ppm)")]
    | Annotated[LensletVideo, Tag("(mpeg_lenslet)")]
    | Annotated[NpzArrays, Tag("(npz)")]
    | Annotated[Print, Tag("(print)")]
    | Annotated[CalibrationSheet, Tag("(calibration_sheet)")],
    told_by(lambda written: str(written.get("kind"))),
]

_CLASSES: tuple[type[OutputOptions], ...] = tuple(get_args(member)[0] for member in get_args(get_args(_Kind)[0]))

KINDS: Mapping[str, type[OutputOptions]] = {one.model_fields["kind"].default: one for one in _CLASSES}
"""Every kind of output, by its word."""


def spelled_out(written: Any) -> Any:
    """Return an output as an object, whichever way it was written.

    Raises
    ------
    ValueError
        If there is no such kind, or it does not come in such a file.

    Examples
    --------
    >>> spelled_out("views.mkv")
    {'kind': 'views', 'codec': 'ffv1'}
    """
    if isinstance(written, str):
        kind, dot, suffix = written.partition(".")
        options = KINDS[kind].SPELLINGS.get(dot + suffix) if kind in KINDS else None
        if options is None:
            raise ValueError(f"an object with a kind, or one of {', '.join(map(repr, spellings()))}, got {written!r}")
        return {"kind": kind, **options}
    if isinstance(written, Mapping) and written.get("kind") not in KINDS:
        kinds = ", ".join(KINDS)
        raise Misfit("kind", expected=f"one of {kinds}", got=repr(written["kind"]) if "kind" in written else "nothing")
    if not isinstance(written, Mapping | OutputOptions):
        raise ValueError(f"an object with a kind, or the name of a file, got {written!r}")
    return written


def spellings() -> tuple[str, ...]:
    """Return every short spelling of an output."""
    return tuple(kind + suffix for kind, options in KINDS.items() for suffix in options.SPELLINGS)


Output = Annotated[_Kind, BeforeValidator(spelled_out)]
"""One output of a job."""

DEFAULT_OUTPUTS: tuple[Output, ...] = (ViewsVideo(), CentreVideo(), OrthoscopicVideo())
"""What a job leaves that says nothing of outputs."""


def check_names(outputs: Iterable[OutputOptions]) -> None:
    """Refuse two outputs that would be called the same.

    Raises
    ------
    Misfit
        Naming the second one, by its place among the outputs.
    """
    known: dict[str, int] = {}
    for place, output in enumerate(outputs):
        before = known.setdefault(output.file_name, place)
        if before != place:
            expected = f"a name of its own: outputs.{before} is {output.file_name} too"
            raise Misfit(f"outputs.{place}.name", expected=expected, got=repr(output.name))


def check_options(outputs: Iterable[OutputOptions], rig: Rig, frames: Sequence[int], *, has_depth: bool) -> None:
    """Refuse options that do not go with the rig or the frames, or ask for a depth that nobody finds.

    Raises
    ------
    Misfit
        Naming the option, by the output's place.
    """
    for place, output in enumerate(outputs):
        try:
            output.check(rig, frames)
        except Misfit as wrong:
            raise Misfit(f"outputs.{place}.{wrong.field}", expected=wrong.expected, got=wrong.got) from wrong
        if output.depth_option and not has_depth:
            got = f"{getattr(output, output.depth_option)!r} with capture.depth false"
            raise Misfit(f"outputs.{place}.{output.depth_option}", expected="a job with capture.depth true", got=got)


def output_called(outputs: Iterable[OutputOptions], file_name: str) -> OutputOptions:
    """Return the output of this file name.

    Raises
    ------
    KeyError
        If there is none.
    """
    for output in outputs:
        if output.file_name == file_name:
            return output
    raise KeyError(file_name)
