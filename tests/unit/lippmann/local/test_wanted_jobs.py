"""The jobs that `capture` and `demo` ask for."""

import inspect
import json
from pathlib import Path

import pytest

from lippmann.cli.commands.farms import farm
from lippmann.errors import BadInput
from lippmann.farm.demo import demo_job
from lippmann.job.optics.rig import Rig
from lippmann.job.spec import parse_spec
from lippmann.local.capture import requested_job
from lippmann.plan.sampling import frame_size
from povtemplates.catalogue import scene_folders
from worker.sandbox.bundle import check_bundle, pack_folder

FULL_TURN = "1-45"
"""The frames that the help of `lippmann demo` calls a full turn."""


def test_the_demo_is_the_paper_s_integral_video() -> None:
    assert f"{FULL_TURN} is a full turn" in (inspect.getsource(farm.demo))
    spec = parse_spec(demo_job(FULL_TURN))
    size = frame_size(spec.rig)
    assert (size.lens_rows, size.lens_cols, size.rows, size.cols) == (90, 90, 720, 720)
    assert spec.rig == Rig()
    parameters = check_bundle(pack_folder(scene_folders()["fish"])).card.resolve(spec.parameters)
    assert len(spec.frame_numbers) * float(parameters["turn_deg_per_frame"]) == 360


def test_the_demo_in_triangles_is_the_same_video() -> None:
    spec = parse_spec(demo_job(FULL_TURN, "mitsuba"))
    assert spec.rig == Rig()
    card = check_bundle(pack_folder(scene_folders()["fish-mesh"])).card
    assert card.engine == "mitsuba"
    assert len(spec.frame_numbers) * (card.clock.per_frame or 0) == 360


def test_a_scene_goes_before_the_scene_of_the_job_file_and_overrides_before_both(tmp_path: Path) -> None:
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"scene": "fish", "rig": {"px_per_lens": 4}, "fps": 5}))
    spec, bundle = requested_job("target-white", str(job), ["rig.px_per_lens=3"])
    assert (spec.scene, spec.rig.px_per_lens, spec.fps) == ("target-white", 3, 5)
    assert bundle == pack_folder(scene_folders()["target-white"])


@pytest.mark.parametrize(("folder", "scene"), [("my_Scene", "my-scene"), ("Öl 2", "scene"), ("-x", "scene")])
def test_a_folder_of_any_name_can_be_captured(tmp_path: Path, folder: str, scene: str) -> None:
    own = tmp_path / folder
    own.mkdir()
    for name in ("scene.inc", "scene.toml"):
        (own / name).write_bytes((scene_folders()["target-white"] / name).read_bytes())
    spec, _ = requested_job(str(own), None, [])
    assert spec.scene == scene


def test_neither_scene_nor_job_is_refused() -> None:
    with pytest.raises(BadInput, match="expected a SCENE or a job"):
        requested_job(None, None, [])
