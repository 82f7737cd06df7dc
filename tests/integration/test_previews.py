"""Previews of a real farm: both engines, a scene that stays loaded, and what a worker is asked to stop."""

from __future__ import annotations

from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.client import Client, Refused
from lippmann.farm.supervisor.descendants import descendants
from service.schemas.preview import Preview
from tests.farm import farm_up
from tests.needs import missing, needs_povray
from tests.waiting import until
from worker.engines.mitsuba.version import Missing, mitsuba_version
from worker.images.read import read_rgb

pytestmark = needs_povray

PATIENT = {"LIPPMANN_MITSUBA": "auto", "LIPPMANN_PREVIEW_TIMEOUT_S": "60", "LIPPMANN_PREVIEW_LIMIT_S": "60"}
"""The environment of the farm; the start of an engine may take long on a busy machine."""
WARM_START_S = 0.5
"""A start of Mitsuba with its scene takes longer on every machine."""


def previewed(client: Client, scene: str, **rig: Any) -> Preview:
    return client.preview({"scene": scene, "rig": rig}, lenses=12, px_per_lens=4)


def commandline(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def size_of(png: str, folder: Path) -> tuple[int, int]:
    """Return the (rows, cols) of a picture that is not black."""
    (folder / "picture.png").write_bytes(b64decode(png))
    light = read_rgb(folder / "picture.png", np.float32)
    assert np.ptp(light) > 0
    return light.shape[0], light.shape[1]


@pytest.mark.promise("Scenes", "A scene that stays loaded for previews serves its owner alone.")
def test_both_engines_render_previews_and_mitsuba_keeps_its_scene(tmp_path: Path) -> None:
    found = mitsuba_version()
    if isinstance(found, Missing):
        missing(f"needs Mitsuba: {found.reason}")
    with farm_up(tmp_path / "farm", slots=1, env=PATIENT) as farm:
        client = farm.client
        until(lambda: client.workers().items)
        cold = previewed(client, "fish-mesh")
        warm = previewed(client, "fish-mesh", lens_array={"offset_mm": 30.0})
        assert (cold.engine, cold.rig.lens_cols, cold.rig.pitch_mm) == ("mitsuba", 12, 7.5)
        assert warm.times.start_s < WARM_START_S < cold.times.start_s
        assert warm.integral.png != cold.integral.png
        key = client.create_key("bob", "submitter", owner_id="bob").key
        with Client(client.address.url, key) as bob:
            assert previewed(bob, "fish-mesh").times.start_s > WARM_START_S
        # The scene of POV-Ray shows the same fish to the same rig.
        traced = previewed(client, "fish")
        for preview in (warm, traced):
            assert size_of(preview.integral.png, tmp_path) == (48, 48)
            assert size_of(preview.view.png, tmp_path) == (12, 12)
            assert preview.worker == client.workers().items[0].name
        with pytest.raises(Refused, match="lens_array") as refused:
            client.preview({"scene": "fish-mesh", "rig": {"lens_array": {"pitch_mm": -1}}})
        assert [problem.field for problem in refused.value.problems] == ["rig.lens_array.pitch_mm"]
        processes = descendants(farm.process.pid)
        servers = [pid for pid in processes if b"worker.tasks.previews.serve" in commandline(pid)]
        assert len(servers) == 1
    until(lambda: not Path(f"/proc/{servers[0]}").exists())
