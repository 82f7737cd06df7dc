"""Files that disappear from the scratch folder are no fault of the scene: the next attempt renders it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lippmann.errors import SceneError, ScratchDamaged
from tests.builders import local_place
from tests.integration.test_render_cache import job, rendered, store_job
from tests.needs import needs_povray
from worker.engines.povray import engine
from worker.engines.povray.render import render as picture_of_povray
from worker.engines.povray.scene import RAYS_FILE
from worker.tasks.attempts.workplace import Workplace

pytestmark = needs_povray

TURNING = "light_source { <-300, 400, -600> 1 } box { -40, 40 rotate 20 * clock * y pigment { rgb <1, 0.4, 0.2> } }"
REFUSED = 'sphere { 0, 60 pigment { rgb 1 } } #error "no"'


@pytest.fixture
def place(tmp_path: Path) -> Workplace:
    return local_place(tmp_path / "data")


def bundle_of(place: Workplace) -> Path:
    (folder,) = filter(Path.is_dir, place.settings.bundles_dir.iterdir())
    return folder


def damaging(monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], object]) -> None:
    """Damage the files before the next picture; `damage` is given the folder of the task."""

    def damage_and_render(*args: Any, **options: Any) -> Any:
        monkeypatch.undo()
        damage(options["task_dir"])
        return picture_of_povray(*args, **options)

    monkeypatch.setattr(engine, "render", damage_and_render)


@pytest.mark.parametrize("cache", [False, True], ids=["rendered", "with a cache"])
def test_a_bundle_that_was_damaged_is_unpacked_again(place: Workplace, cache: bool) -> None:
    store_job(place, job(render={"cache": cache}), text=TURNING)
    first = rendered(place).digests
    (bundle_of(place) / "scene.inc").write_text("sphere { 0, 60 pigment { rgb 1 } }")  # which reads no clock
    assert set(rendered(place, frame=2).digests.values()) != set(first.values())
    (bundle_of(place) / "scene.inc").unlink()
    assert set(rendered(place, frame=3).digests.values()) != set(first.values())


@pytest.mark.parametrize("damage", [Path.unlink, Path.touch], ids=["removed", "changed"])
def test_what_was_rendered_of_a_damaged_bundle_counts_for_nothing(
    place: Workplace, monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], object]
) -> None:
    store_job(place, job(render={"cache": False}))
    whole = rendered(place).digests
    damaging(monkeypatch, lambda _: damage(bundle_of(place) / "scene.inc"))
    with pytest.raises(ScratchDamaged, match="files of the scene disappeared"):
        rendered(place, frame=2)
    assert sorted(rendered(place, frame=2).digests.values()) == sorted(whole.values())


def test_a_file_of_the_worker_that_was_removed_is_named(place: Workplace, monkeypatch: pytest.MonkeyPatch) -> None:
    store_job(place, job(render={"cache": False}, capture={"method": "ray_camera"}))
    damaging(monkeypatch, lambda folder: (folder / RAYS_FILE).unlink())
    with pytest.raises(ScratchDamaged, match=r"lippmann-rays\.inc disappeared"):
        rendered(place)


def test_a_scene_that_is_refused_with_all_its_files_there_is_to_blame_itself(place: Workplace) -> None:
    store_job(place, job(render={"cache": False}), text=REFUSED)
    with pytest.raises(SceneError, match="no"):
        rendered(place)
    assert (bundle_of(place) / "scene.inc").is_file()
