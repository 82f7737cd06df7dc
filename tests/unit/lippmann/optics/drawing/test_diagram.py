"""The drawing: valid XML, exact rays to scale, elements where they stand, labels that can be read."""

from __future__ import annotations

import re
import time
from itertools import combinations, pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.optics.drawing.diagram import WIDTH_PX, draw_bench
from lippmann.optics.drawing.rays import fan, view_of_lens
from lippmann.optics.drawing.svg import LETTER_PX, Panel, element, labels, placed_labels, round_length_mm
from lippmann.optics.lens.surfaces import ImagingLens
from lippmann.optics.lens.trace import Rays, through_lens, unit
from lippmann.optics.rig.bench import Bench, bench, object_rays

SVG = "{http://www.w3.org/2000/svg}"
STAGE = Stage(location=(0, 0, -1000), look_at=(0, 0, 0), near_mm=1000, far_mm=2500)

RIGS: dict[str, dict[str, Any]] = {
    "paper": {},
    "stop": {"f_number": 2.5},
    "perspective": {"camera": {"projection": "perspective"}},
    "double Gauss": {
        "imaging_lens": {"name": "double-gauss-tronnier", "focal_length_mm": 200},
        "f_number": 4,
        "lens_array": {"offset_mm": 5},
    },
    "hexagons": {"lens_array": {"lattice": "hexagonal"}},
    "direct pickup": {"imaging_lens": None, "lens_array": {"count": [20, 20], "offset_mm": -20}},
}

DRAWING_S = 3.0
"""CPU, thirty times what the longest takes: a search without end took ten times more than this."""


def bench_of(**rig: Any) -> Bench:
    return bench(Rig.model_validate(rig), reference_mm=1000.0)


def drawn(**rig: Any) -> ET.Element:
    return ET.fromstring(draw_bench(bench_of(**rig), STAGE))


def of_class(root: ET.Element, class_: str) -> list[ET.Element]:
    return [one for one in root.iter() if class_ in one.get("class", "").split()]


def points(line: ET.Element) -> list[tuple[float, float]]:
    pairs = (pair.split(",") for pair in line.get("points", "").split())
    return [(float(x), float(y)) for x, y in pairs]


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_it_is_valid_xml_with_a_title_and_a_description_and_needs_nothing_from_elsewhere(rig: dict[str, Any]) -> None:
    root = drawn(**rig)
    assert root.tag == f"{SVG}svg"
    assert root.get("role") == "img"
    assert [root[0].tag, root[1].tag] == [f"{SVG}title", f"{SVG}desc"]
    assert root[1].text
    text = ET.tostring(root, encoding="unicode")
    assert not re.findall(r"(?:href|src)=|<script|url\((?!#)|nan|inf\b", text)


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_everything_lies_inside_the_picture(rig: dict[str, Any]) -> None:
    root = drawn(**rig)
    _, _, width, height = map(float, str(root.get("viewBox")).split())
    for text in root.iter(f"{SVG}text"):
        x, y = float(text.get("x", 0)), float(text.get("y", 0))
        assert x >= 0
        assert x + len(text.text or "") * LETTER_PX * 0.97 <= width
        assert 10 <= y <= height


@pytest.mark.parametrize("title", ["<script>alert(1)</script>", 'a & b "c"', "\x00\x1b[31m\ud800", "Fisch, schön"])
def test_any_title_is_text_and_nothing_else(title: str) -> None:
    root = ET.fromstring(draw_bench(bench_of(), STAGE, title=title))
    assert root[0].text == "".join(letter for letter in title if letter.isprintable())
    assert not list(root.iter(f"{SVG}script"))


def test_the_same_bench_is_the_same_text() -> None:
    assert draw_bench(bench_of(), STAGE) == draw_bench(bench_of(), STAGE)


def places_at(lens: ImagingLens, height_mm: float) -> list[float]:
    """Return the z of every surface, and of the stop, at a height."""
    surfaces = zip(lens.surfaces, lens.vertices_mm, strict=True)
    stops = [lens.stop.z_mm] if lens.stop else []
    return [vertex_mm + surface.sag_mm(height_mm) for surface, vertex_mm in surfaces] + stops


@pytest.mark.parametrize("height_mm", [0.0, -120.0])
@pytest.mark.parametrize("rig", [RIGS["paper"], RIGS["stop"], RIGS["double Gauss"]], ids=["paper", "stop", "Gauss"])
def test_drawn_rays_are_those_of_the_exact_trace(rig: dict[str, Any], height_mm: float) -> None:
    here = bench_of(**rig)
    lens = here.imaging_lens
    assert lens is not None
    rays = fan(here, object_mm=1000.0, height_mm=height_mm, image_mm=None)
    assert len(rays) >= 3
    for ray in rays:
        (start_z, start_y), (z, y) = ray.way[:2]
        assert (start_z, start_y) == (-1000.0, height_mm)
        begun = Rays(np.array([0.0, start_y, start_z]), unit(np.array([0.0, y - start_y, z - start_z])))
        behind = through_lens(begun, lens)
        assert ray.way[-1] == pytest.approx((here.mla_z_mm, behind.at_z(here.mla_z_mm)[1]), abs=1e-9)
        # Every kink lies on a surface, or on the plane of the stop.
        for kink_z, kink_y in ray.way[1:-1]:
            assert min(abs(kink_z - z_mm) for z_mm in places_at(lens, abs(kink_y))) < 1e-9


def test_what_one_lens_sees_is_what_the_capture_sees_there() -> None:
    here = bench_of()
    for path in view_of_lens(here, object_mm=2500.0):
        assert path[0][0] == here.camera_z_mm
        height_mm = path[0][1]
        x_mm = here.rig.lens_array.pitch_mm / 2  # of the lens beside the axis: an even count
        seen = object_rays(here, np.array([x_mm, height_mm])).at_z(-2500.0)
        other = object_rays(here, np.array([-x_mm, height_mm])).at_z(-2500.0)
        assert path[-1][1] in (pytest.approx(seen[1]), pytest.approx(other[1]))


def test_both_directions_have_one_scale_and_the_bar_says_it() -> None:
    here = bench_of()
    root = drawn()
    lens = here.imaging_lens
    assert lens is not None
    for bar, first_glass in zip(of_class(root, "bar"), of_class(root, "glass")[::3], strict=True):
        start, end = (float(x) for x in re.findall(r"M([\d.]+) [\d.]+H([\d.]+)", bar.get("d", ""))[0])
        texts = [text.text or "" for text in root.iter(f"{SVG}text") if abs(float(text.get("x", 0)) - end - 8) < 0.02]
        (length_mm,) = (float(text.removesuffix(" mm")) for text in texts if text.endswith(" mm"))
        px_per_mm = (end - start) / length_mm
        xs, ys = zip(*points(first_glass), strict=True)
        assert max(ys) - min(ys) == pytest.approx(200.0 * px_per_mm, abs=0.05)
        assert max(xs) - min(xs) == pytest.approx(84.28 * px_per_mm, abs=0.05)


def test_every_element_is_drawn_by_its_own_surfaces() -> None:
    glass = of_class(drawn(**RIGS["double Gauss"]), "glass")
    assert len(glass) == 2 * 6
    assert len(of_class(drawn(), "glass")) == 2 * 3
    assert len(of_class(drawn(**RIGS["stop"]), "stop")) == 2 * 2
    assert not of_class(drawn(**RIGS["direct pickup"]), "glass")


def test_rays_of_all_four_kinds_are_there_and_explained() -> None:
    root = drawn()
    for class_ in ("near", "far", "edge", "view"):
        lines = [line for line in of_class(root, class_) if line.tag == f"{SVG}polyline"]
        assert len(lines) >= 2 * 5
        assert [key for key in of_class(root, class_) if key.tag == f"{SVG}path"]


@pytest.mark.parametrize(
    "places_mm", [[0, 1, 2, 3, 4], [0, 30, 60, 61, 99], [98, 99, 100], [0, 0, 0], [80, 90, 105, 105]]
)
def test_labels_lie_on_no_other_label_and_no_other_leader(places_mm: list[float]) -> None:
    panel = Panel(left_px=100, axis_px=300, px_per_mm=10, from_mm=0, to_mm=100, half_mm=10)
    marks = [(float(place), f"a label of number {number}") for number, place in enumerate(places_mm)]
    shown = [ET.fromstring(part) for part in labels(panel, placed_labels(panel, marks, width_px=WIDTH_PX))]
    texts, leaders = shown[::2], shown[1::2]
    boxes = [
        (float(t.get("x", 0)), float(t.get("x", 0)) + len(t.text or "") * LETTER_PX, float(t.get("y", 0)))
        for t in texts
    ]
    for (left, right, base), (other_left, other_right, other_base) in combinations(boxes, 2):
        assert base != other_base or right < other_left or other_right < left
    for number, leader in enumerate(leaders):
        x, top = float(leader.get("x1", 0)), float(leader.get("y1", 0))
        crossed = [box for box in boxes if box[0] < x < box[1] and box[2] > top]
        assert crossed in ([], [boxes[number]])


def test_labels_that_have_no_room_are_placed_at_once_and_the_panel_makes_way() -> None:
    panel = Panel(left_px=600, axis_px=300, px_per_mm=1, from_mm=0, to_mm=100, half_mm=10)
    marks = [(0.3 * number, f"a label of {number} mm") for number in range(14)]
    begun_s = time.process_time()
    placed = placed_labels(panel, marks, width_px=WIDTH_PX)
    assert time.process_time() - begun_s < DRAWING_S
    assert all(one.is_clear_of(other) for one, other in combinations(placed, 2))


def test_a_drawing_of_planes_at_one_place_is_made_at_once_and_hides_no_heading() -> None:
    stage = STAGE.model_copy(update={"far_mm": 1000.0})
    rig = {"imaging_lens": {"name": "double-gauss-tronnier", "focal_length_mm": 50}, "f_number": 4}
    begun_s = time.process_time()
    root = ET.fromstring(draw_bench(bench_of(**rig, lens_array={"offset_mm": 1}), stage))
    assert time.process_time() - begun_s < DRAWING_S
    heads = [(float(head.get("y", 0)), 24 + len(head.text or "") * LETTER_PX) for head in of_class(root, "head")]
    for label in of_class(root, "label"):
        x_px, y_px = float(label.get("x", 0)), float(label.get("y", 0))
        assert all(x_px > end_px or abs(y_px - head_px) > 12 for head_px, end_px in heads)


def test_a_panel_maps_millimetres_to_pixels_with_the_height_upward() -> None:
    panel = Panel(left_px=10, axis_px=200, px_per_mm=2, from_mm=-5, to_mm=95, half_mm=50)
    assert (panel.x(-5), panel.x(0), panel.y(0), panel.y(50)) == (10, 20, 200, 100)
    assert panel.points([(0, 0), (1.5, -1)]) == "20,200 23,202"


def test_attributes_and_text_are_escaped() -> None:
    assert element("text", text="<&>", x=1.0, class_='"') == '<text x="1" class=\'"\'>&lt;&amp;&gt;</text>'


@pytest.mark.parametrize("about_mm", [0.013, 0.7, 1.0, 19.0, 5000.0])
def test_a_round_length_is_at_least_half_of_what_is_wanted(about_mm: float) -> None:
    assert about_mm / 2.5 <= round_length_mm(about_mm) <= about_mm * (1 + 1e-9)


def test_ways_go_on_without_a_break() -> None:
    for ray in fan(bench_of(), object_mm=1000.0, height_mm=0.0, image_mm=600.0):
        assert ray.beyond[0] == ray.way[-1]
        assert all(later[0] >= earlier[0] - 20 for earlier, later in pairwise(ray.way))
