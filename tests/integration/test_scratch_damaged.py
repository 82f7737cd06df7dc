"""Files that disappear from the scratch folder are no fault of the scene: the next attempt renders it."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import SceneError, ScratchDamaged
from tests.builders import local_place
from tests.integration.test_render_cache import job, rendered, store_job
from tests.needs import needs_povray
from worker.engines.povray.render import render as picture_of_povray
from worker.tasks import picture
from worker.tasks.workplace import Workplace

pytestmark = needs_povray

REFUSED = 'sphere { 0, 60 pigment { rgb 1 } } #error "no"'


@pytest.fixture
def place(tmp_path: Path) -> Workplace:
    return local_place(tmp_path / "data")


def bundle_of(place: Workplace) -> Path:
    (folder,) = place.settings.bundles_dir.iterdir()
    return folder


@pytest.mark.parametrize("damage", [Path.unlink, lambda path: path.write_text("#error")], ids=["removed", "changed"])
def test_a_bundle_that_was_damaged_in_the_scratch_folder_is_unpacked_again(place: Workplace, damage: object) -> None:
    store_job(place, job(render={"cache": False}))
    whole = rendered(place).digests
    assert callable(damage)
    damage(bundle_of(place) / "scene.inc")
    with pytest.raises(ScratchDamaged, match="files of the scene disappeared"):
        rendered(place, frame=2)
    again = rendered(place, frame=2).digests
    assert sorted(again.values()) == sorted(whole.values())


def test_a_file_of_the_worker_that_was_removed_is_named(place: Workplace, monkeypatch: pytest.MonkeyPatch) -> None:
    store_job(place, job(render={"cache": False}), text=REFUSED)

    def rendered_beside_a_broom(*args: object, **options: object) -> object:
        try:
            return picture_of_povray(*args, **options)  # type: ignore[arg-type]
        finally:
            (Path(str(options["task_dir"])) / picture.POV_FILE).unlink()

    monkeypatch.setattr(picture, "render", rendered_beside_a_broom)
    with pytest.raises(ScratchDamaged, match=r"lippmann-frame\.pov disappeared"):
        rendered(place)


def test_a_scene_that_is_refused_with_all_its_files_there_is_to_blame_itself(place: Workplace) -> None:
    store_job(place, job(render={"cache": False}), text=REFUSED)
    with pytest.raises(SceneError, match="no"):
        rendered(place)
    assert (bundle_of(place) / "scene.inc").is_file()
