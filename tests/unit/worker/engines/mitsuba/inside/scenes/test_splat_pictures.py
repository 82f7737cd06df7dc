"""Splats through the imaging lens and the lens array: depth against the exact trace, the same bits in any order."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.pixel_rays import pixel_rays
from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats
from tests.unit.worker.engines.mitsuba.inside.test_shade import shaded


@pytest.fixture(scope="module")
def sheet(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a flat sheet of 400 splats in the reference plane, each 5 mm from the next, with a gap on the right."""
    from worker.engines.mitsuba.inside.scenes.splats import load_splats

    x, y = (part.ravel() for part in np.meshgrid(np.arange(-10, 10) * 5.0, np.arange(-10, 10) * 5.0))
    kept = x < 1
    centers = np.stack([x, y, np.zeros_like(x)], axis=1)[kept]
    colours = np.stack([0.5 + x / 200, 0.5 + y / 200, np.full_like(x, 0.5)], axis=1)[kept]
    file = write_splats(
        tmp_path_factory.mktemp("sheet") / "sheet.ply",
        centers,
        np.tile([4, 4, 0.004], (len(centers), 1)),
        opacities=np.full(len(centers), 0.9),
        colours=colours,
    )
    return load_splats(file)


@pytest.mark.parametrize("samples", [1, 3])
def test_tiles_threads_and_repeats_of_splats_give_the_same_bits(
    mi: Any, sheet: Any, make_request: Any, samples: int
) -> None:
    import drjit

    drjit.set_thread_count(2)
    whole = shaded(mi, sheet, make_request(samples=samples, channels=("depth",)))
    drjit.set_thread_count(1)
    assert whole["radiance"].std() > 0.01
    for region in [(0, 48, 0, 48), (13, 48, 5, 39)]:
        tile = shaded(mi, sheet, make_request(samples=samples, region=region, channels=("depth",)))
        for kind, values in tile.items():
            part = whole[kind][region[0] : region[1], region[2] : region[3]]
            assert np.array_equal(values, part, equal_nan=True), kind


def test_the_depth_of_a_sheet_of_splats_is_that_of_its_plane(mi: Any, sheet: Any, make_request: Any) -> None:
    request = make_request(channels=("depth", "position"))
    seen = shaded(mi, sheet, request)
    rig_bench = bench(request.job.spec.rig, reference_mm=request.job.stage.reference_mm)
    expected = pixel_rays(rig_bench, rows=request.rows, cols=request.cols).at_z(-500.0)
    x_mm = expected[..., 0]
    is_sheet = np.isfinite(seen["distance"][..., 0])
    np.testing.assert_allclose(seen["position"][is_sheet], expected[is_sheet], atol=0.02)
    assert is_sheet[x_mm < -1].all()
    assert (x_mm > 6).any()
    assert not is_sheet[x_mm > 6].any()
    assert (seen["radiance"][is_sheet] > 0).all()


@pytest.mark.parametrize("channel", ["normal", "albedo", "object", "motion"])
def test_channels_of_surfaces_are_refused_for_splats(sheet: Any, make_request: Any, channel: str) -> None:
    from worker.engines.mitsuba.inside.messages import Failure, read_answer
    from worker.engines.mitsuba.inside.program import Program

    answers = io.BytesIO()
    program = Program(lambda *_: SimpleNamespace(scene=sheet, notes=(), reads=()), answers)
    request = make_request()
    more = {"next_job": request.job} if channel == "motion" else {}
    program.serve(io.BytesIO(request.model_copy(update={"channels": ("depth", channel), **more}).line()))
    answer = read_answer(answers.getvalue())
    assert isinstance(answer, Failure)
    assert answer.error.kind == "unsupported"
    assert answer.error.message == f"Splats have no channel {channel}: they have no surfaces."
