"""The channels of a scene of Mitsuba against the exact trace, from the tiles to the view of a channel."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.messages.orders import TaskKind
from lippmann.job.rendering.channels import channels_in, objects_in, part_names
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.spec import JobSpec
from lippmann.lightfield.depth.depth_map import CHANNELS as DEPTH_PARTS
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.views import view
from lippmann.local.pictures.channel_view import channel_of_view, write_channel_view
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.pixel_rays import pixel_rays
from lippmann.optics.rig.to_scene import rig_axes, rig_to_scene
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size, frame_size
from tests.builders import order_of, small_job, stored_picture, tiles_of
from tests.builders_coded import read_pfm
from tests.mitsuba_place import lend_mitsuba_place
from worker.engines.engine import Rendered, Room, Wanted
from worker.engines.mitsuba.engine import MitsubaEngine
from worker.images.read import read_attributes, read_channels, read_rgb
from worker.sandbox.bundle import pack_folder
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID, local_job, store_plan
from worker.tasks.probe import probe_job

CENTRE, RADIUS = np.array([2.0, 1.0, 2.0]), 4.0
STEP = 0.5
"""The motion of the ball along x from a frame to the next, scene units."""
WALL = ((0.2, 0.4, 0.6), "back wall")
BALL = ((0.75, 0.5, 0.125), "ball")
SCENE = f"""<scene version="3.0.0">
  <default name="clock" value="0"/>
  <shape type="rectangle" id="{WALL[1]}">
    <transform name="to_world"><scale value="6"/><translate z="-4"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.2 0.4 0.6"/></bsdf></bsdf>
  </shape>
  <shape type="sphere" id="{BALL[1]}">
    <transform name="to_world"><translate x="$clock"/></transform>
    <point name="center" x="2" y="1" z="2"/><float name="radius" value="4"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.75 0.5 0.125"/></bsdf>
  </shape>
  <emitter type="constant"/>
</scene>"""
CHANNELS: tuple[Channel, ...] = ("normal", "albedo", "object", "motion")
# The rig stands beside the axis and looks down, in units of 2 mm.
TOML = """file = "a.xml"
[stage]
location = [60, 90, 240]
look_at = [0, 0, 0]
mm_per_unit = 2.0
near_mm = 450
far_mm = 700
[clock]
per_frame = 0.5
"""


place = pytest.fixture(scope="module")(lend_mitsuba_place)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("scene")
    (folder / "scene.toml").write_text(TOML)
    (folder / "a.xml").write_text(SCENE)
    return pack_folder(folder)


def job_of(**more: Any) -> JobSpec:
    capture = {"channels": ["motion", "object", "depth", "albedo", "normal"], **more.pop("capture", {})}
    return small_job("mine", count=(10, 12), capture=capture, render={"cache": False}, **more)


def framed(place: Workplace, bundle: bytes, spec: JobSpec) -> dict[str, NDArray[np.float32]]:
    """Render and assemble a frame in its tiles, and return its masters: light, depth and channels."""
    place.store.delete(JOB_ID)  # or the tiles before would be taken for these
    local_job(place, spec, bundle)
    assert spec.render.tiles != "auto"
    rows, cols = spec.render.tiles
    store_plan(place, StoredPlan(tile_rows=rows, tile_cols=cols, probe_start_s=0, probe_s_per_px=0))
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    found = {"light": stored_picture(place, names.orthoscopic_name(1)).astype(np.float32)}
    for name, stored, parts in (
        ("depth", names.depth_name(1), DEPTH_PARTS),
        ("channels", names.channels_name(1), part_names(CHANNELS)),
    ):
        with place.store.local_path(names.job_artifact(JOB_ID, stored)) as path:
            found[name] = read_channels(path, parts)
    return found


def expected_channels(job: ResolvedJob) -> NDArray[np.float64]:
    """Return the channels of the analytic scene for the rays of the exact trace, in the layout of a master."""
    stage, rig = job.stage, job.spec.rig
    optical_bench = bench(rig, reference_mm=stage.reference_mm)
    layout = frame_size(rig)
    rays = pixel_rays(optical_bench, rows=layout.rows, cols=layout.cols)
    matrix, axes = rig_to_scene(stage, auto="right"), rig_axes(stage, auto="right")
    start = rays.position @ matrix[:3, :3].T + matrix[:3, 3]
    ahead = rays.direction @ axes.T
    with np.errstate(invalid="ignore"):
        to_wall = (-4.0 - start[..., 2]) / ahead[..., 2]
        on_wall = (np.abs((start + to_wall[..., np.newaxis] * ahead)[..., :2]) <= 6).all(axis=-1)
        away = start - CENTRE
        half, rest = (away * ahead).sum(axis=-1), (away**2).sum(axis=-1) - RADIUS**2
        to_ball = -half - np.sqrt(half**2 - rest)
    values = np.full((layout.rows, layout.cols, 10), np.nan)
    values[..., 6] = 0
    ball = np.isfinite(to_ball)
    wall = on_wall & ~ball
    in_scene = (start + to_ball[..., np.newaxis] * ahead - CENTRE) / RADIUS
    values[ball, :3], values[wall, :3] = (in_scene @ axes)[ball], np.array([0.0, 0.0, 1.0]) @ axes
    values[ball, 3:6], values[wall, 3:6] = BALL[0], WALL[0]
    values[ball, 6], values[wall, 6] = 2, 1
    values[ball, 7:], values[wall, 7:] = np.array([STEP * stage.mm_per_unit, 0.0, 0.0]) @ axes, 0
    return orthoscopic(values, layout, inverted=True)


@pytest.fixture(scope="module")
def masters(place: Workplace, bundle: bytes, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Any]:
    """Return the masters of a frame of one tile, and the folder with their files as `capture` leaves it."""
    found: dict[str, Any] = framed(place, bundle, job_of())
    folder = tmp_path_factory.mktemp("out")
    for name in (names.orthoscopic_name(1), names.channels_name(1)):
        (folder / name).parent.mkdir()
        (folder / name).write_bytes(place.store.get_bytes(names.job_artifact(JOB_ID, name)))
    return {**found, "folder": folder, "job": place.job_sheet(JOB_ID).at(1)}


def test_channels_are_those_of_the_analytic_scene_in_the_rig_frame(masters: Mapping[str, Any]) -> None:
    found, expected = masters["channels"], expected_channels(masters["job"])
    assert found.shape == expected.shape
    same = found[..., 6] == expected[..., 6]
    assert same.mean() > 0.995, "but for rays that pass along an edge"
    for number in (0, 1, 2):
        assert (found[..., 6] == number).mean() > 0.02
    nothing = found[..., 6] == 0
    assert np.isnan(found[nothing][:, [0, 1, 2, 3, 4, 5, 7, 8, 9]]).all()
    hit = same & ~nothing
    assert np.abs(found[hit][:, :3] - expected[hit][:, :3]).max() < 2e-3
    assert np.median(np.abs(found[hit][:, :3] - expected[hit][:, :3])) < 1e-5
    np.testing.assert_allclose(found[hit][:, 3:6], expected[hit][:, 3:6], atol=1e-6)
    np.testing.assert_allclose(found[hit][:, 7:], expected[hit][:, 7:], atol=1e-4)
    # Depth and light are of the same rays.
    np.testing.assert_array_equal(np.isfinite(masters["depth"][..., 0]), ~nothing)


def test_the_header_names_the_channels_and_the_objects(masters: Mapping[str, Any]) -> None:
    attributes = read_attributes(masters["folder"] / "channels" / "0001.exr")
    assert channels_in(attributes) == CHANNELS
    assert objects_in(attributes) == (WALL[1], BALL[1])
    assert {"rig", "stage", "frame", "job"} <= set(attributes)


def test_tiles_have_the_bits_of_the_whole_frame(place: Workplace, bundle: bytes, masters: Mapping[str, Any]) -> None:
    tiled = framed(place, bundle, job_of(tiles=[3, 2]))
    for name, values in tiled.items():
        np.testing.assert_array_equal(values, masters[name], err_msg=name)


def test_a_supersampled_job_has_the_same_channels(place: Workplace, bundle: bytes, masters: Mapping[str, Any]) -> None:
    fine = framed(place, bundle, job_of(capture={"supersample": 2}))
    np.testing.assert_array_equal(fine["channels"], masters["channels"])
    np.testing.assert_array_equal(fine["depth"], masters["depth"])
    assert not np.array_equal(fine["light"], masters["light"])


def test_one_request_renders_light_and_channels(
    place: Workplace, bundle: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Wanted] = []
    render = MitsubaEngine.render

    def kept(self: MitsubaEngine, wanted: Wanted, room: Room) -> Rendered:
        asked.append(wanted)
        return render(self, wanted, room)

    monkeypatch.setattr(MitsubaEngine, "render", kept)
    framed(place, bundle, job_of())
    assert [wanted.channels for wanted in asked] == [("depth", *CHANNELS)]
    # The probe asks for them too, so that a scene that has no such channel is refused before it is rendered.
    probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor())
    assert {wanted.channels for wanted in asked[1:]} == {("depth", *CHANNELS)}


def test_a_view_of_a_channel_is_the_view_of_its_numbers(masters: Mapping[str, Any], tmp_path: Path) -> None:
    master = masters["folder"] / "orthoscopic" / "0001.exr"
    values = masters["channels"]
    expected = view(values, display_size(masters["job"].spec.rig), 3, 4)
    cases: tuple[tuple[Channel, str, slice], ...] = (
        ("normal", ".exr", slice(0, 3)),
        ("albedo", ".pfm", slice(3, 6)),
        ("object", ".png", slice(6, 7)),
    )
    for channel, suffix, parts in cases:
        found = write_channel_view(master, tmp_path / f"{channel}{suffix}", channel, number=(3, 4))
        np.testing.assert_array_equal(found.values, expected[..., parts])
    np.testing.assert_array_equal(read_channels(tmp_path / "normal.exr", part_names(("normal",))), expected[..., :3])
    np.testing.assert_array_equal(read_pfm(tmp_path / "albedo.pfm"), expected[..., 3:6])
    shown = read_rgb(tmp_path / "object.png", np.float32)
    assert len({tuple(colour) for colour in shown.reshape(-1, 3).tolist()}) == len(np.unique(expected[..., 6]))
    normal = channel_of_view(master, "normal", number=None).values
    ball = channel_of_view(master, "object", number=None).values[..., 0] == 2
    cols = np.argwhere(ball)[:, 1]
    # The left side of the ball looks to the left, as the observer sees it.
    assert normal[ball][cols == cols.min(), 0].mean() < -0.5 < 0.5 < normal[ball][cols == cols.max(), 0].mean()
    (tmp_path / "orthoscopic").mkdir()
    (tmp_path / "orthoscopic" / "0001.exr").write_bytes(master.read_bytes())
    with pytest.raises(BadInput, match=r"expected a master of a job with normal in capture\.channels, got none"):
        channel_of_view(tmp_path / "orthoscopic" / "0001.exr", "normal", number=None)
