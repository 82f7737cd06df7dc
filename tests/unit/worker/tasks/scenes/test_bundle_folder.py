"""Bundles in the scratch folder are unpacked once and whole, and damage is noticed."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import pytest

from lippmann.errors import BundleError, SceneError, ScratchDamaged
from lippmann.plan.artifact_names import bundle_name
from tests.builders import local_place
from worker.sandbox.bundle import digest_of, pack_folder
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.scenes.bundle_folder import UNPACKED

SCENE = """
title = "A ball"
file = "a.pov"

[stage]
location = [0, 0, -10]
look_at = [0, 0, 0]
near_mm = -20
far_mm = 20
"""


def test_a_bundle_is_unpacked_once_and_its_folder_exists(tmp_path: Path) -> None:
    place, digest = with_bundle(tmp_path)
    with place.bundle(digest) as folder:
        assert sorted(path.name for path in folder.iterdir()) == ["a.pov", "scene.toml"]
        number = folder.stat().st_ino
    with place.bundle(digest) as again:
        assert (again, again.stat().st_ino) == (folder, number)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "a file removed": lambda folder: (folder / "a.pov").unlink(),
    "a file changed": lambda folder: (folder / "a.pov").write_text("sphere { 0, 9 }"),
    "a file added": lambda folder: (folder / "b.inc").touch(),
    "the folder removed": shutil.rmtree,
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_what_is_made_of_a_damaged_bundle_counts_for_nothing_and_the_next_use_unpacks_it_again(
    tmp_path: Path, damage: Callable[[Path], object]
) -> None:
    place, digest = with_bundle(tmp_path)

    def damage_and_blame(folder: Path) -> None:
        damage(folder)
        raise SceneError("the scene is to blame")

    for use in (damage, damage_and_blame):
        with pytest.raises(ScratchDamaged):
            _use(place, digest, use)
    with place.bundle(digest) as folder:
        assert (folder / "a.pov").read_text() == "sphere { 0, 1 }"
    damage(folder)
    with place.bundle(digest) as folder:
        assert sorted(path.name for path in folder.iterdir()) == ["a.pov", "scene.toml"]


def test_a_bundle_that_was_replaced_while_it_was_used_was_damaged(tmp_path: Path) -> None:
    place, digest = with_bundle(tmp_path)

    def miss_what_another_attempt_replaces(folder: Path) -> None:
        (folder / "a.pov").unlink()
        with place.bundle(digest):
            assert (folder / "a.pov").is_file()
        raise SceneError("there was no a.pov")

    with pytest.raises(ScratchDamaged):
        _use(place, digest, miss_what_another_attempt_replaces)


def _use(place: Workplace, digest: str, use: Callable[[Path], object]) -> None:
    with place.bundle(digest) as folder:
        use(folder)


@pytest.mark.promise(
    "Between processes", "A worker unpacks a scene bundle only if its content is the one that its digest names."
)
def test_a_bundle_with_other_content_than_its_name_says_is_refused_and_nothing_is_left(tmp_path: Path) -> None:
    place, digest = with_bundle(tmp_path)
    other = "0" * 64
    place.store.put_bytes(bundle_name(other), place.store.get_bytes(bundle_name(digest)))
    with pytest.raises(BundleError, match="other content"), place.bundle(other):
        pass
    assert list(place.settings.bundles_dir.iterdir()) == []


def test_a_bundle_that_cannot_be_published_is_an_error_and_nothing_is_left(tmp_path: Path) -> None:
    place, digest = with_bundle(tmp_path)
    bundles = place.settings.bundles_dir
    bundles.mkdir(parents=True)
    folder = f"{digest}-{UNPACKED}"
    (bundles / folder).write_bytes(b"a file in the way")
    with pytest.raises(NotADirectoryError), place.bundle(digest):
        pass
    assert [path.name for path in bundles.iterdir()] == [folder]


def test_attempts_that_unpack_one_bundle_at_the_same_time_all_get_its_folder(tmp_path: Path) -> None:
    place, digest = with_bundle(tmp_path)
    starts = Barrier(8)

    def unpacked(_: int) -> Path:
        starts.wait(60)
        with place.bundle(digest) as folder:
            return folder

    with ThreadPoolExecutor(8) as pool:
        folders = set(pool.map(unpacked, range(8)))
    folder = f"{digest}-{UNPACKED}"
    assert {path.name for path in place.settings.bundles_dir.iterdir()} == {folder, f"{folder}.json"}
    assert folders == {place.settings.bundles_dir / folder}


def test_beyond_the_limit_the_least_recently_used_bundles_are_removed_and_those_in_use_stay(tmp_path: Path) -> None:
    place, first = with_bundle(tmp_path)
    second, third, fourth = (another_bundle(place, tmp_path, number) for number in (2, 3, 4))
    limit_mb = 3.5 * size_bytes(tmp_path / "scene") / 1e6
    place = replace(place, settings=place.settings.model_copy(update={"bundles_mb": limit_mb}))
    for age_s, digest in ((300, first), (200, second), (100, third)):
        with place.bundle(digest) as folder:
            used_s = time.time() - age_s
        os.utime(folder, (used_s, used_s))
    with place.bundle(first):  # now the one that was used last
        pass
    with place.bundle(second) as used:
        os.utime(used, (0, 0))
        with place.bundle(fourth):
            assert unpacked(place) == {first, second, fourth}
        assert (used / "a.pov").is_file()
    with place.bundle(third) as folder:
        assert (folder / "a.pov").read_text().startswith("sphere")


def test_a_bundle_larger_than_the_limit_is_used_and_removed_with_the_next_one(tmp_path: Path) -> None:
    place, first = with_bundle(tmp_path)
    second = another_bundle(place, tmp_path, 2)
    place = replace(place, settings=place.settings.model_copy(update={"bundles_mb": 0.0}))
    with place.bundle(first) as folder:
        assert (folder / "a.pov").is_file()
    with place.bundle(second):
        assert unpacked(place) == {second}
    left = {path.name for path in place.settings.bundles_dir.iterdir()}
    assert left == {f"{second}-{UNPACKED}", f"{second}-{UNPACKED}.json"}


def test_attempts_that_remove_the_bundles_of_each_other_all_get_theirs(tmp_path: Path) -> None:
    place, first = with_bundle(tmp_path)
    digests = [first, *(another_bundle(place, tmp_path, number) for number in (2, 3))]
    place = replace(place, settings=place.settings.model_copy(update={"bundles_mb": 0.0}))

    def use(number: int) -> bool:
        with place.bundle(digests[number % 3]) as folder:
            return (folder / "a.pov").is_file()

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(use, range(60)))


def another_bundle(place: Workplace, folder: Path, number: int) -> str:
    """Store a bundle of the same size with other content, and return its digest."""
    (folder / "scene" / "a.pov").write_text(f"sphere {{ 0, {number} }}")
    bundle = pack_folder(folder / "scene")
    place.store.put_bytes(bundle_name(digest_of(bundle)), bundle)
    return digest_of(bundle)


def size_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.iterdir())


def unpacked(place: Workplace) -> set[str]:
    return {path.name.partition("-")[0] for path in place.settings.bundles_dir.iterdir() if path.is_dir()}


def with_bundle(folder: Path) -> tuple[Workplace, str]:
    """Return a place whose store has a bundle, and the bundle's digest."""
    place, files = local_place(folder / "data"), folder / "scene"
    files.mkdir()
    (files / "scene.toml").write_text(SCENE)
    (files / "a.pov").write_text("sphere { 0, 1 }")
    bundle = pack_folder(files)
    place.store.put_bytes(bundle_name(digest_of(bundle)), bundle)
    return place, digest_of(bundle)
