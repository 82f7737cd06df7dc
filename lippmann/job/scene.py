"""A scene as a job sees it: title, parameters, clock and the stage where the rig stands.

The form is that of a bundle's `scene.toml`; `parse_scene` reads it, `SceneCard.resolve` fills in a job's parameters.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from lippmann.errors import BundleError, FieldProblem, SpecError
from lippmann.job.imported_sheets import ForeignSheets
from lippmann.job.problems import problems_of
from lippmann.job.spec import Clock, ParameterValue
from lippmann.job.stage import Stage

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_FILE = re.compile(r"(?:[A-Za-z0-9_][A-Za-z0-9_.+-]*/)*[A-Za-z0-9_][A-Za-z0-9_. +-]*\.(?:pov|inc)", re.IGNORECASE)
"""A path that leads nowhere upward and that POV-Ray needs no quotes for; only the file's own name may have blanks."""

SCENE_FILE = "scene.inc"
"""What POV-Ray reads of a bundle that names no other file."""

MAX_PARAMETER = 1e15
"""POV-Ray reckons in 64-bit floats, which tell whole numbers apart up to here."""

RESERVED = frozenset(
    (
        *("keyframes", "clock", "version", "pi", "tau", "x", "y", "z", "t", "u", "v"),
        *("red", "green", "blue", "filter", "transmit"),
        *("image_width", "image_height", "frame_number", "initial_clock", "final_clock", "clock_delta"),
    )
)
"""Words that POV-Ray, or a job, keeps for itself and that a parameter might be named by."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Parameter(_Part):
    """A number, switch or colour that a job may set."""

    type: Literal["number", "integer", "boolean", "color"]
    default: ParameterValue
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    description: str = ""

    @model_validator(mode="after")
    def _default_is_allowed(self) -> Self:
        fault = self.fault_of(self.default)
        if fault:
            raise ValueError(f"a default that is {fault}, got {self.default!r}")
        return self

    def fault_of(self, value: ParameterValue) -> str | None:
        """Return what `value` should have been, or None if it is right."""
        if self.type == "boolean":
            return None if isinstance(value, bool) else "true or false"
        if self.type == "color":
            right = isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", value)
            return None if right else "a colour like '#20a0ff'"
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"{'an integer' if self.type == 'integer' else 'a number'}"
        if abs(value) > MAX_PARAMETER:
            return f"{self.type} from {-MAX_PARAMETER:g} to {MAX_PARAMETER:g}"
        if self.type == "integer" and not float(value).is_integer():
            return "an integer"
        below = self.minimum is not None and value < self.minimum
        above = self.maximum is not None and value > self.maximum
        if below or above:
            return f"{self.type} from {self.minimum} to {self.maximum}"
        return None


_NO_STAGE = {"location": (0, 0, -1), "look_at": (0, 0, 0), "near_mm": 1, "far_mm": 1}
"""Of a bundle of which nothing is rendered: a place like any other, and of no meaning."""


class SceneCard(_Part):
    """What `scene.toml` says."""

    file: str = Field(default=SCENE_FILE, max_length=200)
    """The .inc or .pov that is the scene; a .pov is read as by itself, and its camera is overruled."""
    title: str = Field(default_factory=lambda given: given["file"], min_length=1, max_length=200)
    """The file's name when not given."""
    description: str = ""
    license: str = ""
    stage: Stage
    clock: Clock = Clock()
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    sheets: ForeignSheets | None = None
    """In place of a scene: integral images that are there already."""

    @model_validator(mode="before")
    @classmethod
    def _either_scene_or_sheets(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or data.get("sheets") is None:
            return data
        # A card that was stored has these filled in.
        return {"stage": _NO_STAGE, "title": "Integral images from elsewhere", **data}

    @field_validator("file")
    @classmethod
    def _usable_file(cls, file: str) -> str:
        if not _FILE.fullmatch(file):
            raise ValueError(
                "a .pov or .inc inside the bundle, its path of letters, digits and _ . + - between slashes"
            )
        return file

    @field_validator("parameters")
    @classmethod
    def _usable_names(cls, parameters: dict[str, Parameter]) -> dict[str, Parameter]:
        for name in parameters:
            if not _NAME.fullmatch(name) or name in RESERVED:
                raise ValueError(f"parameter names in lower snake case that POV-Ray does not keep, got {name!r}")
        return parameters

    def resolve(self, given: Mapping[str, ParameterValue]) -> dict[str, ParameterValue]:
        """Return every parameter with its value: the job's, or the default.

        Raises
        ------
        SpecError
            If the job sets a parameter that the scene does not have, or one out of bounds.
        """
        problems = [
            FieldProblem(field=f"parameters.{name}", expected=self._known_names(), got=f"unknown parameter {name!r}")
            for name in given
            if name not in self.parameters
        ]
        for name, parameter in self.parameters.items():
            fault = parameter.fault_of(given[name]) if name in given else None
            if fault:
                problems.append(FieldProblem(field=f"parameters.{name}", expected=fault, got=repr(given[name])))
        if problems:
            raise SpecError.of(problems)
        return {name: given.get(name, parameter.default) for name, parameter in self.parameters.items()}

    def _known_names(self) -> str:
        return f"one of {', '.join(sorted(self.parameters))}" if self.parameters else "no parameters"


def parse_scene(data: Mapping[str, Any]) -> SceneCard:
    """Return the scene that a parsed `scene.toml` describes.

    Raises
    ------
    BundleError
        Naming every field that is wrong.
    """
    try:
        return SceneCard.model_validate(data)
    except ValidationError as error:
        raise BundleError("scene.toml: " + "; ".join(map(str, problems_of(error)))) from error
