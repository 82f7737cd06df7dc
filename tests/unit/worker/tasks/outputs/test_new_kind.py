"""A new kind of output is two registered modules: its options and its maker. Nothing else is changed here."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Literal

import numpy as np
import pytest

from lippmann.errors import SpecError
from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.output import KINDS, Name, OutputOptions, output_kind
from lippmann.job.resolved import StoredPlan
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan import artifact_names as names
from lippmann.plan.tasks import plan_tasks
from tests.builders_outputs import given_job
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import DESCRIPTIONS, MAKERS, describes, discover_makers, makes
from worker.whole_file import write_bytes

JOB: dict[str, Any] = {
    "frames": "1-2",
    "outputs": ["histogram.json", {"kind": "histogram", "bins": 4, "name": "coarse"}],
}


@pytest.fixture
def histogram_is_a_kind(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Register a kind of output as its two modules would, and remove it afterwards."""
    discover_makers()
    before = dict(KINDS), dict(MAKERS), dict(DESCRIPTIONS)

    @output_kind
    class Histogram(OutputOptions):
        """Counts of the codes of every frame."""

        SPELLINGS = {".json": {}}  # noqa: RUF012 - as the class variable is declared

        kind: Literal["histogram"] = "histogram"
        name: Name = "histogram"
        bins: int = 8

        @property
        def suffix(self) -> str:
            return ".json"

    @makes(Histogram)
    def make_histogram(context: OutputContext, output: Histogram) -> None:
        for frame in context.with_progress(context.source.frames, len(context.source.frames)):
            counts, _ = np.histogram(context.source.image(frame).pixels, output.bins, (0, 1))
            data = json.dumps(counts.tolist()).encode()
            context.store_file(f"{names.frame_stem(frame)}.json", partial(write_bytes, data=data))

    @describes(Histogram)
    def about_histogram(source: FrameSource, output: Histogram) -> Mapping[str, Any]:
        return {"bins": output.bins}

    yield
    for registry, kinds in zip((KINDS, MAKERS, DESCRIPTIONS), before, strict=True):
        registry.clear()  # type: ignore[attr-defined]
        registry.update(kinds)  # type: ignore[attr-defined]


@pytest.mark.usefixtures("histogram_is_a_kind")
def test_a_new_kind_of_output_passes_through_a_job(tmp_path: Any) -> None:
    job = given_job(tmp_path, **JOB)
    plan = StoredPlan(tile_rows=1, tile_cols=1, probe_start_s=0.0, probe_s_per_px=0.0)
    planned = [task for task in plan_tasks(job.sheet.spec, plan) if task.kind is TaskKind.ENCODE]
    assert [(task.output, task.artifact) for task in planned] == [
        ("histogram.json", "exports/histogram.json.json"),
        ("coarse.json", "exports/coarse.json.json"),
    ]
    for task in planned:
        assert task.output is not None
        job.make(task.output)
    with job.file("exports/coarse/0002.json") as path:
        counts = json.loads(path.read_text())
    assert len(counts) == 4
    assert sum(counts) == job.stored_sheet(2).size
    sidecar = job.sidecar("coarse.json")
    assert sidecar["files"] == ["exports/coarse/0001.json", "exports/coarse/0002.json"]
    assert sidecar["format"] == {"bins": 4}


@pytest.mark.usefixtures("histogram_is_a_kind")
def test_a_new_kind_of_output_is_in_the_schema_and_its_errors_name_its_options() -> None:
    assert "Histogram" in JobSpec.model_json_schema()["$defs"]
    with pytest.raises(SpecError, match=r"outputs\.0\.bins: expected"):
        parse_spec({"scene": "fish", "outputs": [{"kind": "histogram", "bins": "many"}]})
    written = parse_spec({"scene": "fish", **JOB}).model_dump_json()
    assert JobSpec.model_validate_json(written).outputs[1].model_dump()["bins"] == 4


def test_every_kind_has_a_maker() -> None:
    discover_makers()
    assert set(MAKERS) == set(KINDS.values())
    assert set(DESCRIPTIONS) <= set(MAKERS)


def test_two_kinds_cannot_have_one_word() -> None:
    with pytest.raises(ValueError, match="'views'"):

        @output_kind
        class Views(OutputOptions):
            kind: Literal["views"] = "views"
            name: Name = "other"
