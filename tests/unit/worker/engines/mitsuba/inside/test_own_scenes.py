"""The built-in scenes in meshes, through the loader and the rig of the program in the sandbox."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import parse_spec
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST, SCENES_FOLDER
from worker.engines.mitsuba.inside.messages import Request


def shown(name: str, *, clock: float, **parameters: float) -> NDArray[np.float32]:
    """Return a small picture of a scene, linear (row, col, 3); its loader leaves nothing out."""
    from worker.engines.mitsuba.inside.scenes.load import load  # they import what the variant makes
    from worker.engines.mitsuba.inside.shade import bands, shade_band

    bundle = SCENES_FOLDER / name
    manifest = parse_scene(read_toml((bundle / MANIFEST).read_bytes(), field=MANIFEST))
    array = {"count": [15, 15], "pitch_mm": 6.0, "focal_length_mm": 19.8}
    spec = parse_spec({"scene": name, "rig": {"lens_array": array, "px_per_lens": 4}, "parameters": parameters})
    job = ResolvedJob.of("j", spec, manifest, bundle="b").at(1)
    request = Request(number=1, job=job, frame=1, rows=60, cols=60, region=(0, 60, 0, 60), bundle=str(bundle), out="1")
    loaded = load(bundle, job, clock)
    assert loaded.notes == ()
    return np.concatenate([shade_band(loaded.scene, request, rows)["radiance"] for rows in bands(request)]).reshape(
        60, 60, 3
    )


@pytest.mark.parametrize(("name", "quarter", "turn"), [("fish-mesh", 90.0, 360.0), ("turning-knot", 0.45, 1.8)])
def test_the_clock_turns_the_object_round_and_back(mi: Any, name: str, quarter: float, turn: float) -> None:
    first, other, again = (shown(name, clock=clock) for clock in (0.0, quarter, turn))
    changed = np.abs(other - first).max(axis=-1) > 0.05
    assert 0.05 < changed.mean() < 0.7, "the object turns; the rest stays"
    assert np.median(np.abs(again - first)) < 1e-4


def test_the_parameters_of_the_fish_move_fish_and_water(mi: Any) -> None:
    first = shown("fish-mesh", clock=0.0)
    for changed in ({"base_turn_deg": 60.0}, {"ripple": 1.5}, {"water_y_mm": -100.0}):
        assert np.abs(shown("fish-mesh", clock=0.0, **changed) - first).mean() > 0.01, changed
