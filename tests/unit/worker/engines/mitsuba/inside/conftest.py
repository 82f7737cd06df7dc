"""A variant of Mitsuba for the tests of the program in the sandbox, chosen once."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import parse_spec
from tests.unit.worker.engines.mitsuba.inside.variant import variant_of_tests
from worker.engines.mitsuba.inside.messages import Request


@pytest.fixture(scope="session")
def mi() -> Any:
    import mitsuba

    mitsuba.set_variant(variant_of_tests())
    return mitsuba


@pytest.fixture(scope="session")
def make_request() -> Any:
    """Return a function that makes a request for a small rig on a stage 500 mm before the reference plane."""

    def make(
        *, mm_per_unit: float = 1.0, region: tuple[int, int, int, int] | None = None, channels: tuple[str, ...] = (),
        rig: dict[str, Any] | None = None, **render: Any,
    ) -> Request:  # fmt: skip
        far = 500 / mm_per_unit
        stage = Stage(location=(0, 0, far), look_at=(0, 0, 0), near_mm=450, far_mm=550, mm_per_unit=mm_per_unit)
        manifest = SceneManifest(title="A", stage=stage).model_copy(update={"file": "scene.xml"})
        arrays = {"lens_array": {"count": (6, 6)}, "px_per_lens": 8} | (rig or {})
        spec = parse_spec({"scene": "mine", "rig": arrays, "render": render})
        job = ResolvedJob.of("j", spec, manifest, bundle="b").at(1)
        rows, cols = job.spec.rig.layout.rows, job.spec.rig.layout.cols
        return Request(
            number=1, job=job, frame=1, rows=rows, cols=cols, region=region or (0, rows, 0, cols), channels=channels,
            bundle="/nowhere", out="1",
        )  # fmt: skip

    return make
