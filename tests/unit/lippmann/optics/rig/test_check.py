"""What a job's maker is told about his optics before anything is rendered."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import OpticsError, SpecError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.check import check_job, check_rig
from lippmann.optics.rig.method import capture_method

STAGE = Stage(location=(0, 0, -1000), look_at=(0, 0, 0), reference_mm=1000.0, near_mm=1000.0, far_mm=2500.0)


def job(**lens_array: object) -> JobSpec:
    return parse_spec({"scene": "fish", "rig": {"lens_array": lens_array}})


@pytest.mark.parametrize(
    ("offset_mm", "words"),
    [
        (60.0, "outside the image space, on the lens's side: all is shown real"),
        (40.0, "near parts are shown real, far ones virtual"),
        (10.0, "near parts are shown real, far ones virtual"),
        (-10.0, "outside the image space, on the camera's side: all is shown virtual"),
    ],
)
def test_the_papers_four_positions_are_told_apart(offset_mm: float, words: str) -> None:
    assert words in check_rig(job(offset_mm=offset_mm), STAGE)[0]


def test_an_array_inside_the_imaging_lens_is_refused_by_name() -> None:
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.offset_mm: expected below 184\.3 mm.* got 200 mm"):
        check_rig(job(offset_mm=200.0), STAGE)


def test_an_unknown_imaging_lens_is_refused_with_the_known_ones() -> None:
    spec = parse_spec({"scene": "fish", "rig": {"imaging_lens": "petzval"}})
    with pytest.raises(SpecError, match=r"rig\.imaging_lens: expected one of athineos-2006, .*, got 'petzval'"):
        check_rig(spec, STAGE)


def test_a_slow_imaging_lens_is_said() -> None:
    notes = check_rig(job(focal_length_mm=1.5, pitch_mm=1.0), STAGE)
    assert any("slower than the array" in note for note in notes)
    assert not any("slower" in note for note in check_rig(job(), STAGE))


ASPHERE: dict[str, Any] = {
    "surfaces": [
        {"radius_mm": 250, "thickness_mm": 30, "index": 1.5, "semi_aperture_mm": 90, "conic": -0.6},
        {"radius_mm": -400, "index": 1, "semi_aperture_mm": 90},
    ]
}


def rig(**fields: Any) -> JobSpec:
    return parse_spec({"scene": "fish", "rig": fields})


def test_direct_pickup_shows_all_behind_the_display() -> None:
    (note,) = check_rig(rig(imaging_lens=None, lens_array={"offset_mm": -200}), STAGE)
    assert note == "Direct pickup: all is shown virtual, s from -1700.0 mm (far) to -200.0 mm (near)."


def test_direct_pickup_behind_what_it_should_see_is_refused() -> None:
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.offset_mm: expected a negative one .* got 40 mm"):
        check_rig(rig(imaging_lens=None), STAGE)


def test_an_array_larger_than_the_devices_window_is_refused() -> None:
    with pytest.raises(
        OpticsError, match=r"rig\.device\.window_px: expected at least 2126 x 2126 px.* got 2000 x 2400"
    ):
        check_rig(rig(device={"dpi": 600, "window_px": [2000, 2400]}), STAGE)


def test_an_asphere_goes_by_the_ray_camera() -> None:
    assert capture_method(rig(imaging_lens=ASPHERE), STAGE) == "ray_camera"


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            {"capture": {"method": "glass"}},
            r"capture\.method: expected ray_camera, because .*aspheric.* got glass",
        ),
        ({"render": {"antialias": {}}}, r"render\.antialias: expected off, because .*aspheric.* got on"),
    ],
)
def test_an_asphere_of_glass_is_refused_by_name(more: dict[str, Any], message: str) -> None:
    spec = parse_spec({"scene": "fish", "rig": {"imaging_lens": ASPHERE}} | more)
    with pytest.raises(OpticsError, match=message):
        check_rig(spec, STAGE)


@pytest.mark.parametrize(
    ("more", "method"),
    [
        ({}, "ray_camera"),
        ({"capture": {"method": "glass"}}, "glass"),
        ({"render": {"antialias": {}}}, "glass"),
        ({"rig": {"dispersion": True}}, "ray_camera"),
        ({"rig": {"dispersion": True}, "render": {"antialias": {}}}, "glass"),
    ],
)
def test_the_cheaper_road_is_taken_that_can_do_it(more: dict[str, Any], method: str) -> None:
    assert capture_method(parse_spec({"scene": "fish"} | more), STAGE) == method


@pytest.mark.parametrize("mm_per_unit", [1000.0, 0.0001])
def test_glass_at_a_scale_that_spoils_it_is_refused(mm_per_unit: float) -> None:
    spec = parse_spec({"scene": "fish", "capture": {"method": "glass"}})
    with pytest.raises(OpticsError, match=r"capture\.method: expected ray_camera, because stage\.mm_per_unit is .*"):
        capture_method(spec, STAGE.model_copy(update={"mm_per_unit": mm_per_unit}))


def test_a_sweep_is_checked_at_its_keys() -> None:
    card = SceneManifest(title="A", stage=STAGE)

    def sweep(last_mm: float) -> ResolvedJob:
        spec = parse_spec(
            {
                "scene": "fish",
                "frames": "1-9",
                "rig": {"lens_array": {"offset_mm": {"keyframes": [[1, 60], [9, last_mm]]}}},
            }
        )
        return ResolvedJob.of("j", spec, card, bundle="b")

    assert [note.partition(", s from ")[0] for note in check_job(sweep(-10))] == [
        "From frame 1: The array stands outside the image space, on the lens's side: all is shown real",
        "From frame 3: The array stands in the image space: near parts are shown real, far ones virtual",
        "From frame 8: The array stands outside the image space, on the camera's side: all is shown virtual",
    ]
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.offset_mm: .* got 200 mm at frame 9"):
        check_job(sweep(200))


def test_what_is_wrong_between_two_keys_is_found_too() -> None:
    """From one meniscus to another by way of a lens that is none."""
    surfaces = [
        {"radius_mm": {"keyframes": [[1, -200], [3, 200]]}, "thickness_mm": 9, "index": 1.6, "semi_aperture_mm": 40},
        {"radius_mm": -90, "index": 1, "semi_aperture_mm": 40},
    ]
    spec = parse_spec({"scene": "fish", "frames": "1-3", "rig": {"imaging_lens": {"surfaces": surfaces}}})
    with pytest.raises(SpecError, match=r"rig\.imaging_lens\.surfaces\.0\.radius_mm: .* at frame 2"):
        check_job(ResolvedJob.of("j", spec, SceneManifest(title="A", stage=STAGE), bundle="b"))


def test_a_long_animation_is_checked_in_about_a_second() -> None:
    """No timed test: what is counted is how many frames are tried."""
    keys = [[frame, frame % 7] for frame in range(1, 1001)]
    spec = parse_spec(
        {"scene": "fish", "frames": "1-300000", "rig": {"lens_array": {"offset_mm": {"keyframes": keys}}}}
    )
    assert len(spec.checked_frames()) <= 200
    assert {1, 300_000} <= set(spec.checked_frames())


def test_an_array_inside_the_rim_of_the_last_surface_is_refused() -> None:
    meniscus = {
        "surfaces": [
            {"radius_mm": 60, "thickness_mm": 25, "index": 1.7, "semi_aperture_mm": 40},
            {"radius_mm": 120, "index": 1, "semi_aperture_mm": 40},
        ]
    }
    image_mm = 40 + bench(rig(imaging_lens=meniscus).rig, reference_mm=1000.0).mla_behind_lens_mm
    near_glass = rig(imaging_lens=meniscus, lens_array={"count": [40, 40], "offset_mm": image_mm - 2})
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.offset_mm: expected below .* behind the imaging lens"):
        check_rig(near_glass, STAGE)


@pytest.mark.parametrize("stop_z_mm", [2000, -2000])
def test_a_stop_behind_the_array_or_in_the_scene_is_refused(stop_z_mm: float) -> None:
    lens = ASPHERE | {"stop_z_mm": stop_z_mm}
    with pytest.raises(OpticsError, match=r"rig\.imaging_lens\.stop_z_mm: expected a stop between the scene"):
        check_rig(rig(imaging_lens=lens, stop_mm=20), STAGE)


@pytest.mark.parametrize("device", [{"dpi": 1e5}, {"dpi": 600, "margin_px": 32_000}])
def test_a_picture_for_a_device_that_no_machine_holds_is_refused(device: dict[str, Any]) -> None:
    with pytest.raises(OpticsError, match=r"rig\.device: expected a picture of at most 32768 px a side"):
        check_rig(rig(device=device, px_per_lens=8), STAGE)
