"""The job as it is stored: what was asked for plus what it resolved to, so that every attempt sees the same.

`job.json` and `plan.json` are artifacts. The service writes them, workers read them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Self

from pydantic import BaseModel, ConfigDict

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.imported_sheets import ForeignSheets
from lippmann.job.problems import Misfit
from lippmann.job.scene import SCENE_FILE, SceneCard
from lippmann.job.spec import Clock, JobSpec, ParameterValue
from lippmann.job.stage import Stage, changed_stage


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class JobSheet(_Part):
    """`job.json`: a job with its scene resolved."""

    job_id: str
    spec: JobSpec
    bundle: str
    """SHA-256 of the scene bundle's zip; the artifact is `scenes/<bundle>.zip`."""
    stage: Stage
    """The scene's, with what the job says otherwise; at the first key where it is animated, see `at`."""
    file: str = SCENE_FILE
    """Of the bundle: the one that is the scene."""
    clock: Clock
    parameters: dict[str, ParameterValue]
    """Every parameter of the scene, defaults filled in."""
    sheets: ForeignSheets | None = None
    """Of a bundle of integral images: then nothing is rendered, and `spec` has the rig that they are of."""

    @classmethod
    def of(cls, job_id: str, spec: JobSpec, card: SceneCard, *, bundle: str) -> Self:
        """Return the sheet of a job of a scene.

        Raises
        ------
        SpecError
            If the scene does not have a parameter, or it or the stage is out of bounds, at any keyframe.
        """
        if card.sheets is not None:
            spec = card.sheets.job_of(spec)
        _check_moving_parameters(spec, card)
        for frame in spec.tried_frames():
            try:
                there = spec.at(frame)
                _check_outputs(there)
                card.resolve(there.parameters)
                changed_stage(card.stage, there.stage)
            except SpecError as error:
                raise at_frame(error, frame) if spec.animation else error from error
        return cls(
            job_id=job_id,
            spec=spec,
            bundle=bundle,
            stage=changed_stage(card.stage, spec.stage),
            file=card.file,
            clock=spec.clock or card.clock,
            parameters=card.resolve(spec.parameters),
            sheets=card.sheets,
        )

    def at(self, frame: int) -> JobSheet:
        """Return the job as it is at a frame: rig, stage and parameters without keyframes."""
        there = self.spec.at(frame)
        update = {
            "spec": there,
            "stage": changed_stage(self.stage, there.stage),
            "parameters": self.parameters | there.parameters,
        }
        return self.model_copy(update=update)


def _check_outputs(spec: JobSpec) -> None:
    """Refuse outputs that do not go with the job as it is at a frame.

    Raises
    ------
    SpecError
        Naming the option.
    """
    try:
        spec.check_outputs()
    except Misfit as wrong:
        raise SpecError.of([FieldProblem(field=wrong.field, expected=wrong.expected, got=str(wrong.got))]) from wrong


def _check_moving_parameters(spec: JobSpec, card: SceneCard) -> None:
    """Refuse keyframes on parameters that know no values between two others."""
    problems = []
    for path in spec.animation:
        part, _, name = path.partition(".")
        if part == "parameters" and name in card.parameters and card.parameters[name].type != "number":
            got = f"type {card.parameters[name].type}"
            problems.append(FieldProblem(field=path, expected="a parameter of type number for keyframes", got=got))
    if problems:
        raise SpecError.of(problems)


def at_frame(error: SpecError, frame: int) -> SpecError:
    """Return the error with the frame at which it came, if it does not say so yet."""
    where = f" at frame {frame}"
    return type(error).of(
        problem if problem.got.endswith(where) else replace(problem, got=problem.got + where)
        for problem in error.problems
    )


class PlanSheet(_Part):
    """`plan.json`: how the job was cut."""

    tile_rows: int
    tile_cols: int
    probe_start_s: float
    probe_s_per_px: float
    renders: bool = True
    """Whether there is anything to render: not of integral images that are there already."""
