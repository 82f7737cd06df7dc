"""All kinds of output as one field of a job.

An output is written as an object, `{"kind": "views", "codec": "ffv1", "name": "lossless"}`, or in short by the name of
its file, `views.mp4`: the kind, and a suffix that stands for options.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from lippmann.job import outputs
from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.output import KINDS, OutputOptions
from lippmann.job.outputs.videos import CentreVideo, OrthoscopicVideo, ViewsVideo
from lippmann.untrusted.shown import shown

for _module in iter_modules(outputs.__path__, f"{outputs.__name__}."):
    import_module(_module.name)  # registers its kinds


def spelled_out(written: Any) -> Any:
    """Return an output as an object, from either spelling.

    Raises
    ------
    ValueError
        If there is no such kind, or the kind has no such file.

    Examples
    --------
    >>> spelled_out("views.mkv")
    {'kind': 'views', 'codec': 'ffv1'}
    """
    if isinstance(written, str):
        kind, dot, suffix = written.partition(".")
        options = KINDS[kind].SPELLINGS.get(dot + suffix) if kind in KINDS else None
        if options is None:
            hint = "".join(f" (did you mean {one}?)" for one in get_close_matches(written[:100], spellings(), n=1))
            known = ", ".join(map(repr, spellings()))
            raise ValueError(f"an object with a kind, or one of {known}{hint}, got {shown(written)}")
        return {"kind": kind, **options}
    if isinstance(written, Mapping) and not (isinstance(written.get("kind"), str) and written["kind"] in KINDS):
        kinds = ", ".join(sorted(KINDS))
        got = shown(written["kind"]) if "kind" in written else "nothing"
        if isinstance(written.get("kind"), str):
            kinds += "".join(f" (did you mean {one}?)" for one in get_close_matches(written["kind"][:100], KINDS, n=1))
        raise FieldError("kind", expected=f"one of {kinds}", got=got)
    if not isinstance(written, Mapping | OutputOptions):
        raise ValueError(f"an object with a kind, or the name of a file, got {shown(written)}")
    return written


def spellings() -> tuple[str, ...]:
    """Return every short spelling of an output."""
    return tuple(kind + suffix for kind in sorted(KINDS) for suffix in KINDS[kind].SPELLINGS)


def parse_output(written: Any) -> OutputOptions:
    """Return an output as a model of its kind, from either spelling.

    Raises
    ------
    ValueError
        If there is no such kind, or an option is not valid.
    """
    spelled = spelled_out(written)
    return spelled if isinstance(spelled, OutputOptions) else KINDS[spelled["kind"]].model_validate(spelled)


class _ByKind:
    """Makes pydantic choose the model of an output by its kind, also of kinds that are registered later."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        as_its_own_class = core_schema.simple_ser_schema("any")
        return core_schema.no_info_plain_validator_function(parse_output, serialization=as_its_own_class)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        models: dict[Any, CoreSchema] = {kind: KINDS[kind].__pydantic_core_schema__ for kind in sorted(KINDS)}
        return handler(core_schema.tagged_union_schema(models, discriminator=lambda written: written))


if TYPE_CHECKING:
    Output = Annotated[OutputOptions, _ByKind]
    """One output of a job."""
else:
    # FastAPI describes every model that it finds in an annotation; the base class is no kind of its own.
    Output = Annotated[Any, _ByKind]

DEFAULT_OUTPUTS: tuple[OutputOptions, ...] = (ViewsVideo(), CentreVideo(), OrthoscopicVideo())
"""The outputs of a job that names no outputs."""


def check_names(outputs: Iterable[OutputOptions]) -> None:
    """Refuse two outputs with the same file name.

    Raises
    ------
    FieldError
        The error names the second one by its place among the outputs.
    """
    known: dict[str, int] = {}
    for place, output in enumerate(outputs):
        before = known.setdefault(output.file_name, place)
        if before != place:
            expected = f"a name of its own: outputs.{before} is {output.file_name} too"
            raise FieldError(f"outputs.{place}.name", expected=expected, got=repr(output.name))


def check_options(
    outputs: Iterable[OutputOptions], rig: Rig, frames: Sequence[int], *, has_depth: bool, viewing_distance_mm: float
) -> None:
    """Refuse options that do not fit the rig or the frames, or ask for a depth that the job does not have.

    Parameters
    ----------
    outputs
        The outputs of the job.
    rig
        The rig of the job.
    frames
        The numbers of the job's frames.
    has_depth
        True if the job finds the depth of every pixel.
    viewing_distance_mm
        The distance of an observer for whom an output does not say another.

    Raises
    ------
    FieldError
        Naming the option, by the output's place.
    """
    for place, output in enumerate(outputs):
        try:
            output.check(rig, frames)
            output.check_viewing(rig, viewing_distance_mm)
        except FieldError as wrong:
            raise FieldError(f"outputs.{place}.{wrong.field}", expected=wrong.expected, got=wrong.got) from wrong
        if output.depth_option and not has_depth:
            got = f"{getattr(output, output.depth_option)!r} with capture.depth false"
            raise FieldError(
                f"outputs.{place}.{output.depth_option}", expected="a job with capture.depth true", got=got
            )


def output_called(outputs: Iterable[OutputOptions], file_name: str) -> OutputOptions:
    """Return the output with a file name.

    Raises
    ------
    KeyError
        If no output has it.
    """
    for output in outputs:
        if output.file_name == file_name:
            return output
    raise KeyError(file_name)
