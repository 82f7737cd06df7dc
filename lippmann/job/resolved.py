"""Resolved jobs: a job specification with the stage, clock and parameters of its scene.

`job.json` and `plan.json` are artifacts. The service writes them and workers read them, so that every attempt renders
the same job.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Self

from pydantic import BaseModel, ConfigDict

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.animation.clock import Clock
from lippmann.job.fields.problems import FieldError
from lippmann.job.rendering.engines import Engine, engine_of_file, engine_problems
from lippmann.job.rendering.workers import JobRequirement
from lippmann.job.scenes.imported_sheets import ImportedSheets
from lippmann.job.scenes.scene import SCENE_FILE, SceneManifest
from lippmann.job.scenes.scene_camera import SceneCamera
from lippmann.job.scenes.stage import Stage, StageChange, changed_stage
from lippmann.job.spec import JobSpec, ParameterValue


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ResolvedJob(_Part):
    """A job that is resolved against its scene: the content of `job.json`."""

    job_id: str
    spec: JobSpec
    bundle: str
    """SHA-256 of the scene bundle's zip; the artifact is `scenes/<bundle>.zip`."""
    stage: Stage
    """The stage of the scene with the changes of the job. Animated numbers have their first values; see `at`."""
    file: str = SCENE_FILE
    """The scene file of the bundle."""
    include: tuple[str, ...] = ()
    """The folders of the bundle in which POV-Ray also looks for files."""
    clock: Clock
    parameters: dict[str, ParameterValue]
    """The value of every parameter of the scene, defaults included."""
    sheets: ImportedSheets | None = None
    """The imported integral images of the bundle, if it has some. Nothing is rendered then, and the rig of `spec` is
    that of the sheets."""
    cache_scope: str = ""
    """The owner with whose jobs this one shares the render cache; empty for the cache of the whole farm."""

    @classmethod
    def of(cls, job_id: str, spec: JobSpec, manifest: SceneManifest, *, bundle: str, frames: int | None = None) -> Self:
        """Resolve a job against the manifest of its scene.

        Parameters
        ----------
        job_id
            The identifier of the job.
        spec
            The job specification.
        manifest
            The manifest of the scene.
        bundle
            The SHA-256 digest of the scene bundle.
        frames
            The number of frames of the animation if neither the job nor its scene has one; by default the job's last
            frame.

        Raises
        ------
        SpecError
            If the scene does not have a parameter of the job, a value is out of bounds at any keyframe, or the engine
            of the scene cannot do what the job asks for.
        """
        if manifest.sheets is not None:
            spec = manifest.sheets.job_on_sheets(spec)
        problems = [*_problems_of_moving_parameters(spec, manifest), *engine_problems(spec, manifest.file)]
        if problems:
            raise SpecError.of(problems)
        for frame in spec.checked_frames():
            try:
                at_frame = spec.at(frame)
                _check_outputs(at_frame)
                manifest.resolve(at_frame.parameters)
                changed_stage(manifest.stage, at_frame.stage)
            except SpecError as error:
                raise add_frame(error, frame) if spec.animation else error from error
        return cls(
            job_id=job_id,
            spec=spec,
            bundle=bundle,
            stage=changed_stage(manifest.stage, spec.stage),
            file=manifest.file,
            include=manifest.include,
            clock=_whole_clock(spec.clock or manifest.clock, frames or spec.frame_numbers[-1]),
            parameters=manifest.resolve(spec.parameters),
            sheets=manifest.sheets,
        )

    @property
    def engine(self) -> Engine:
        """The engine that renders the job."""
        return engine_of_file(self.file)

    @property
    def requirement(self) -> JobRequirement:
        """The requirement of the job for the workers that do its tasks."""
        engine = "none" if self.sheets is not None else self.engine
        return JobRequirement.model_validate(self.spec.workers.model_dump() | {"engine": engine})

    def placed(self, stage: Stage, frame: int) -> ResolvedJob:
        """Return the job at a frame with a stage that nothing changes any more."""
        there = self.at(frame)
        return there.model_copy(update={"stage": stage, "spec": there.spec.model_copy(update={"stage": StageChange()})})

    def at(self, frame: int) -> ResolvedJob:
        """Return the job at a frame: its rig, stage and parameters have the values of that frame."""
        at_frame = self.spec.at(frame)
        update = {
            "spec": at_frame,
            "stage": changed_stage(self.stage, at_frame.stage),
            "parameters": self.parameters | at_frame.parameters,
        }
        return self.model_copy(update=update)


def _whole_clock(clock: Clock, frames: int) -> Clock:
    """Return a clock that knows the number of frames of the animation, which is `frames` unless it has one."""
    return clock if clock.frames else clock.model_copy(update={"frames": frames})


def _check_outputs(spec: JobSpec) -> None:
    """Refuse outputs that are incompatible with the job at a frame.

    Raises
    ------
    SpecError
        The error names the option.
    """
    try:
        spec.check_outputs()
    except FieldError as wrong:
        raise SpecError.of([FieldProblem(field=wrong.field, expected=wrong.expected, got=str(wrong.got))]) from wrong


def _problems_of_moving_parameters(spec: JobSpec, manifest: SceneManifest) -> Iterator[FieldProblem]:
    """Yield the keyframes of parameters that cannot be interpolated."""
    for path in spec.animation:
        part, _, name = path.partition(".")
        if part == "parameters" and name in manifest.parameters and manifest.parameters[name].type != "number":
            got = f"type {manifest.parameters[name].type}"
            yield FieldProblem(field=path, expected="a parameter of type number for keyframes", got=got)


def add_frame(error: SpecError, frame: int) -> SpecError:
    """Return the error with the number of the frame at which it occurs, unless the error names it already."""
    where = f" at frame {frame}"
    return type(error).of(
        problem if problem.got.endswith(where) else replace(problem, got=problem.got + where)
        for problem in error.problems
    )


class StoredPlan(_Part):
    """The plan of a job: the content of `plan.json`."""

    tile_rows: int
    tile_cols: int
    probe_start_s: float
    probe_s_per_px: float
    renders: bool = True
    """True if the job renders something; a job on imported sheets does not."""
    camera: SceneCamera | None = None
    """The scene's own camera at frame 1, if the probe has read one that the stage depends on."""
    previews: tuple[int, ...] = ()
    """The frames that come before the others; none in plans of earlier releases."""
