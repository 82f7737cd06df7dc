"""Keys of the render cache: whatever changes a pixel changes the key, and nothing else does."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import pytest

from lippmann.job.animation.clock import Clock
from lippmann.job.messages.orders import TileIndex
from lippmann.job.rendering.render_settings import RenderSettings
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import Parameter, SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan.render_cache import CHANNELS, DEPTH, POV, TILE, UNSEEN, RenderSoftware, entry_files, tile_key
from lippmann.plan.sampling import Tile

SOFTWARE = RenderSoftware(
    engine="povray", engine_version="3.7", engine_includes="a", templates="b", code="c"
)  # fmt: skip
SCENE = SceneManifest(
    title="A wheel",
    stage=Stage(location=(0, 0, -500), look_at=(0, 0, 0), reference_mm=500, near_mm=400, far_mm=600),
    parameters={"turn": Parameter(type="number", default=0.0)},
)
TILE_0 = Tile(TileIndex(row=0, col=0), 0, 20, 0, 40)
TURNS = {"turn": {"keyframes": [[1, 0], [4, 90], [5, 0], [8, 90]]}}


def resolved(job_id: str = "j1", *, bundle: str = "b" * 64, scene: SceneManifest = SCENE, **spec: Any) -> ResolvedJob:
    return ResolvedJob.of(job_id, parse_spec({"scene": "wheel", "frames": "1-8", **spec}), scene, bundle=bundle)


def key(
    job: ResolvedJob | None = None,
    frame: int = 1,
    tile: Tile = TILE_0,
    software: RenderSoftware = SOFTWARE,
    *,
    reads_clock: bool = False,
    reads_frames: bool = False,
) -> str:
    return tile_key(job or resolved(), frame, tile, software, reads_clock=reads_clock, reads_frames=reads_frames)


def test_the_number_of_a_frame_counts_if_the_scene_reads_it() -> None:
    assert len({key(frame=frame, reads_frames=True) for frame in range(1, 9)}) == 8
    assert key(reads_frames=True) != key(resolved(frames="1-9"), reads_frames=True), "final_frame differs"


def test_a_key_is_the_same_in_every_job() -> None:
    assert key() == key(resolved("j2"))
    assert len(key()) == 64


@pytest.mark.parametrize(
    "spec",
    [
        {"title": "Another"},
        {"frames": "1-3"},
        {"fps": 30},
        {"priority": 90},
        {"slots": 3},
        {"workers": {"pool": "night", "tags": ["fast"]}},
        {"outputs": ["centre.mp4"]},
        {"display": {"viewing_distance_mm": 500}},
        {"render": {"tiles": [2, 2], "timeout_s": 99, "stall_s": 99, "memory_mb": 999}},
        {"render": {"parse_timeout_s": 99, "photons_timeout_s": 99, "probe_timeout_s": 99, "cache": False}},
        {"parameters": {"turn": 0.0}},
        {"stage": {"location": [0, 0, -500]}},
    ],
)
def test_what_changes_no_pixel_changes_no_key(spec: dict[str, Any]) -> None:
    assert key(resolved(**spec)) == key()


@pytest.mark.parametrize(
    "changes",
    [
        {"bundle": "c" * 64},
        {"scene": SCENE.model_copy(update={"file": "other.inc"})},
        {"parameters": {"turn": 1e-9}},
        {"stage": {"mm_per_unit": 2}},
        {"stage": {"reference_mm": 501}},
        {"rig": {"px_per_lens": 16}},
        {"rig": {"imaging_lens": None}},
        {"rig": {"f_number": 8}},
        {"rig": {"lens_array": {"count": [80, 80]}}},
        {"capture": {"supersample": 2}},
        {"capture": {"depth": True}},
        {"capture": {"method": "glass"}},
        {"scene": SCENE.model_copy(update={"file": "scene.xml"}), "capture": {"channels": ["normal"]}},
        {"render": {"antialias": {}}},
    ],
)
def test_what_changes_pixels_changes_the_key(changes: dict[str, Any]) -> None:
    assert key(resolved(**changes)) != key()


def test_for_every_field_it_is_decided_whether_it_changes_pixels() -> None:
    counted = {"scene", "rig", "capture", "render"}
    assert counted | (UNSEEN["spec"].keys() - {"render"}) == JobSpec.model_fields.keys()
    assert not (counted - {"render"}) & UNSEEN["spec"].keys()
    counted_of_render = {"antialias", "samples", "path_depth", "clamp"}
    assert counted_of_render | UNSEEN["spec"]["render"] == RenderSettings.model_fields.keys()
    assert not counted_of_render & UNSEEN["spec"]["render"]


@pytest.mark.parametrize("field", [each.name for each in fields(RenderSoftware)])
def test_every_part_of_the_software_changes_the_key(field: str) -> None:
    assert key(software=replace(SOFTWARE, **{field: "other"})) != key()


def test_owners_who_do_not_share_have_keys_of_their_own() -> None:
    ann, bob = (resolved().model_copy(update={"cache_scope": owner}) for owner in ("ann", "bob"))
    assert len({key(ann), key(bob), key()}) == 3
    assert key(ann) == key(resolved("j2").model_copy(update={"cache_scope": "ann"}))


def test_the_pixels_of_a_tile_count_and_its_index_does_not() -> None:
    edges = (0, 20, 0, 40)
    for place in range(4):
        moved = [edge + 10 * (place == each) for each, edge in enumerate(edges)]
        assert key(tile=Tile(TILE_0.index, *moved)) != key()
    assert key(tile=replace(TILE_0, index=TileIndex(row=3, col=1))) == key()


def test_a_turn_that_repeats_after_4_frames_has_4_keys_in_8_frames() -> None:
    keys = [key(resolved(parameters=TURNS), frame) for frame in range(1, 9)]
    assert keys[:4] == keys[4:]
    assert len(set(keys)) == 4


def test_frames_at_other_clocks_are_others_only_where_the_scene_reads_the_clock() -> None:
    assert len({key(frame=frame) for frame in range(1, 9)}) == 1
    assert len({key(frame=frame, reads_clock=True) for frame in range(1, 9)}) == 8


def test_a_clock_that_repeats_repeats_the_keys() -> None:
    job = resolved(clock={"first": 2, "per_frame": 0.5, "repeat_frames": 4})
    assert [job.clock.at(frame) for frame in (1, 4, 5, 9)] == [2, 3.5, 2, 2]
    keys = [key(job, frame, reads_clock=True) for frame in range(1, 9)]
    assert keys[:4] == keys[4:]
    assert len(set(keys)) == 4


def test_a_motion_depends_on_the_next_frame_and_nothing_else_does() -> None:
    """Two jobs whose frame 1 is the same, and whose frame 2 is not."""
    mesh = SCENE.model_copy(update={"file": "scene.xml"})
    turns = [{"turn": {"keyframes": [[1, 0], [8, degrees]]}} for degrees in (70, 140)]
    for channels, count in ((["motion"], 2), (["normal"], 1)):
        jobs = [resolved(scene=mesh, parameters=turn, capture={"channels": channels}) for turn in turns]
        assert len({key(job) for job in jobs}) == count
    clocks = [resolved(scene=mesh, capture={"channels": ["motion"]}, clock={"per_frame": step}) for step in (1, 2)]
    assert len({key(job) for job in clocks}) == 2


def test_the_clock_is_the_one_that_the_frame_has_not_the_fields_that_make_it() -> None:
    late = resolved(clock={"first": 5, "per_frame": 1})
    assert Clock(first=5).at(2) == Clock(first=6).at(1)
    assert key(late, 2, reads_clock=True) == key(resolved(clock={"first": 6}), 1, reads_clock=True)


def test_the_tile_is_the_last_file_of_an_entry() -> None:
    tile = replace(TILE_0, index=TileIndex(row=1, col=2))
    assert list(entry_files(resolved().spec, 7, tile).items()) == [
        (POV, "pov/0007/01-02.pov"),
        (TILE, "tiles/0007/01-02.exr"),
    ]
    assert list(entry_files(resolved(capture={"depth": True}).spec, 7, tile)) == [POV, DEPTH, TILE]
    mesh = SCENE.model_copy(update={"file": "scene.xml"})
    spec = resolved(scene=mesh, capture={"channels": ["depth", "object"]}).spec
    assert list(entry_files(spec, 7, tile, has_source=False)) == [DEPTH, CHANNELS, TILE]
