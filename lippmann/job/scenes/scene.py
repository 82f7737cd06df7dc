"""Scene manifests: the title, parameters, clock and stage of a scene, as a bundle's `scene.toml` describes them.

`parse_scene` validates the manifest; `SceneManifest.resolve` returns its parameters with the values that a job sets.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from lippmann.errors import BundleError, FieldProblem, SpecError
from lippmann.job.animation.clock import Clock
from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.rendering.engines import MITSUBA_FILES, POVRAY_FILES, Engine, engine_of_file
from lippmann.job.scenes.imported_sheets import ImportedSheets
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import MAX_PARAMETERS, ParameterValue

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_PART = r"(?![. ])[ !#-.0-\[\]-~]+"
"""A folder that POV-Ray searches: printable ASCII without quotation marks and backslashes."""
_FOLDER = re.compile(rf"(?:{_PART}(?:/|\Z))+")
_SUFFIX = "|".join(map(re.escape, (*POVRAY_FILES, *MITSUBA_FILES)))
_FILE = re.compile(rf'(?:{_PART}/)*(?![. ])[^"/\\]*(?:{_SUFFIX})', re.IGNORECASE)
"""A path below the bundle, whose last part may have letters of any language."""

SCENE_FILE = "scene.inc"
"""The default scene file of a bundle."""

MAX_PARAMETER = 1e15
"""The greatest magnitude of a parameter; POV-Ray computes in 64-bit floats, which are exact for integers up to here."""

RESERVED = frozenset(
    (
        *("keyframes", "clock", "version", "pi", "tau", "x", "y", "z", "t", "u", "v"),
        *("red", "green", "blue", "filter", "transmit"),
        *("image_width", "image_height", "frame_number", "initial_frame", "final_frame"),
        *("initial_clock", "final_clock", "clock_delta", "clock_on"),
    )
)
"""The names that POV-Ray or a job reserves, which no parameter may have."""


class Parameter(JobModel):
    """A parameter of a scene, which a job may set."""

    type: Literal["number", "integer", "boolean", "color"]
    """The type of the value."""
    default: ParameterValue
    """The value if the job does not set the parameter."""
    minimum: float | None = None
    """The least value of a number."""
    maximum: float | None = None
    """The greatest value of a number."""
    unit: str = ""
    """The unit of a number."""
    description: str = ""
    """A description of the parameter."""

    @model_validator(mode="after")
    def _check_default(self) -> Self:
        fault = self.violation(self.default)
        if fault:
            raise ValueError(f"a default that is {fault}, got {self.default!r}")
        return self

    def violation(self, value: ParameterValue) -> str | None:
        """Return the description of the values that are allowed if `value` is not one of them, else None."""
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
"""The stage of a bundle of imported sheets, which has no meaning because nothing is rendered."""


class SceneManifest(JobModel):
    """The manifest of a scene, `scene.toml`."""

    file: str = Field(default=SCENE_FILE, max_length=200)
    """The scene file: .inc or .pov for POV-Ray; .xml, .gltf, .glb, .obj or .ply for Mitsuba. The camera of the rig
    replaces the camera of the file."""
    include: tuple[str, ...] = Field(default=(), max_length=16)
    """The folders of the bundle in which POV-Ray also looks for files, as `Library_Path` in an .ini names them."""
    title: str = Field(default_factory=lambda given: given["file"], min_length=1, max_length=200)
    """The title of the scene; by default the name of the file."""
    description: str = Field(default="", max_length=20_000)
    """A description of the scene."""
    license: str = Field(default="", max_length=20_000)
    """The license of the scene."""
    stage: Stage
    """The position of the rig in the scene, and the scale."""
    clock: Clock = Clock()
    """The clock of the scene, which a job may replace."""
    parameters: dict[str, Parameter] = Field(default_factory=dict, max_length=MAX_PARAMETERS)
    """The parameters of the scene by name."""
    sheets: ImportedSheets | None = None
    """The imported integral images of a bundle without a scene."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_stage(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or data.get("sheets") is None:
            return data
        # A manifest that was stored has both.
        return {"stage": _NO_STAGE, "title": "Integral images from elsewhere", **data}

    @field_validator("file")
    @classmethod
    def _check_file(cls, file: str) -> str:
        if not _FILE.fullmatch(file) or not file.isprintable():
            raise ValueError(
                f"a file inside the bundle that ends with one of {', '.join((*POVRAY_FILES, *MITSUBA_FILES))}, without "
                "quotation marks and backslashes, in folders of ASCII letters"
            )
        return file

    @field_validator("include")
    @classmethod
    def _check_include(cls, folders: tuple[str, ...]) -> tuple[str, ...]:
        for folder in folders:
            if len(folder) > 200 or not _FOLDER.fullmatch(folder):
                raise ValueError(
                    "folders inside the bundle, of ASCII letters without quotation marks and backslashes, "
                    f"got {folder[:80]!r}"
                )
        return tuple(folder.rstrip("/") for folder in folders)

    @field_validator("parameters")
    @classmethod
    def _check_names(cls, parameters: dict[str, Parameter]) -> dict[str, Parameter]:
        for name in parameters:
            if not _NAME.fullmatch(name) or name in RESERVED:
                raise ValueError(f"parameter names in lower snake case that POV-Ray does not keep, got {name!r}")
        return parameters

    @model_validator(mode="after")
    def _check_engine(self) -> Self:
        if self.engine == "mitsuba" and self.include:
            raise FieldError(
                "include", expected=f"no folders, which POV-Ray alone searches, for {self.file}", got="some"
            )
        if self.engine == "mitsuba" and self.stage.follow_camera:
            raise FieldError(
                "stage.follow_camera",
                expected=f"false: only POV-Ray tells the camera of a frame, not {self.file}",
                got="true",
            )
        return self

    @property
    def engine(self) -> Engine:
        """The engine that reads the scene file."""
        return engine_of_file(self.file)

    def resolve(self, given: Mapping[str, ParameterValue]) -> dict[str, ParameterValue]:
        """Return the value of every parameter: that of the job, or the default.

        Raises
        ------
        SpecError
            If the job sets a parameter that the scene does not have, or a value that is out of bounds.
        """
        problems = [
            FieldProblem(field=f"parameters.{name}", expected=self._known_names(), got=f"unknown parameter {name!r}")
            for name in given
            if name not in self.parameters
        ]
        for name, parameter in self.parameters.items():
            fault = parameter.violation(given[name]) if name in given else None
            if fault:
                problems.append(FieldProblem(field=f"parameters.{name}", expected=fault, got=repr(given[name])))
        if problems:
            raise SpecError.of(problems)
        return {name: given.get(name, parameter.default) for name, parameter in self.parameters.items()}

    def _known_names(self) -> str:
        return f"one of {', '.join(sorted(self.parameters))}" if self.parameters else "no parameters"


def parse_scene(data: Mapping[str, Any]) -> SceneManifest:
    """Validate the data of a `scene.toml`.

    Raises
    ------
    BundleError
        The error names every invalid field.
    """
    try:
        return SceneManifest.model_validate(data)
    except ValidationError as error:
        raise BundleError("scene.toml: " + "; ".join(map(str, problems_of(error, SceneManifest)))) from error
