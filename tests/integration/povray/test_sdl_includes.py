"""Every include file works alone, twice and in old scenes, and computes as Python does."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from lippmann.job.optics.rig import LensArray
from lippmann.optics.lens.dispersion import povray_dispersion
from lippmann.optics.rig.array import extent_mm
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.microlens import microlens
from tests.builders import small_job
from tests.integration.povray.sdl import INCLUDES, LIBRARY, STAND_IN, evaluate, render_text, run_povray

TUNABLE = re.compile(r"^#ifndef \((Lippmann_\w+)\)\s+#declare \1 = (?!version)([^;{]+?)( \{|;)", re.MULTILINE)
"""The name and the default of a value that the user can declare before the include."""
LOCAL = re.compile(r"#local (\w+) =")

ALL = "".join(f'#include "lippmann/{include.name}"\n' for include in INCLUDES)
CALLS = """
#declare My_Lens = array[3][4] { { 50, 5, 1.5, 10 }, { -50, 3, 1.6, 8 }, { 0, 0, 1, 10 } };
object { Lippmann_Imaging_Lens(My_Lens) Lippmann_Stage(<0, 0, -3>, <0, 0, 0>, y, 1000) }
object { Lippmann_Imaging_Lens(Lippmann_Plano_Convex(100, 60, 1.5)) }
object { Lippmann_Microlens_Array_Square(2, 2, 1, 3.3, 1.49, 0) }
object { Lippmann_Microlens_Array_Hexagonal(2, 2, 1, 3.3, 1.49, 1) }
sphere { <9, 9, 9>, 1 texture { Lippmann_Clear } Lippmann_Glass(1.5, Lippmann_Dispersion(1.5, 60)) }
#declare My_Image_Z = Lippmann_Image_Z(My_Lens, 1000);
#declare My_Rays = mesh2 { vertex_vectors { 3, Lippmann_Ray(0, -z) } face_indices { 1, <0, 1, 2> } };
#declare My_Camera = camera { Lippmann_Camera_Square(2, 2, 1, 10) };
#declare My_Camera = camera { Lippmann_Camera_Hexagonal(2, 2, 1, 10) };
#declare My_Camera = camera { Lippmann_Perspective(2, 2, 1, 10) };
#declare My_Camera = camera { Lippmann_Ray_Camera(My_Rays, 0, z, y, 1) };
#declare My_Camera = camera { Lippmann_Depth_Camera(1e3 * y, 8, My_Rays, 0, z, y, 1) };
"""
"""Every macro of the library, but for the fog."""


@pytest.mark.parametrize("include", INCLUDES, ids=lambda include: include.stem)
def test_an_include_alone_and_twice_in_a_scene_of_version_3_0_leaves_the_version(include: Path, tmp_path: Path) -> None:
    """POV-Ray refuses macros under #version 3.0, so the include must switch the version and switch it back."""
    text = f'#version 3.0;\n#include "lippmann/{include.name}"\n#declare Between = version;\n'
    text += f'#include "lippmann/{include.name}"\n'
    assert evaluate(tmp_path, text, "version", "Between") == [3.0, 3.0]


@pytest.mark.parametrize("version", ["3.5", "3.62", "3.7"])
def test_every_macro_works_under_an_older_version_and_leaves_it(version: str, tmp_path: Path) -> None:
    text = f"#version {version};\n{ALL}{CALLS}"
    assert evaluate(tmp_path, text, "version") == [float(version)]


def test_a_scene_without_a_version_looks_as_it_does_without_the_library(tmp_path: Path) -> None:
    """A #version inside an include would switch on POV-Ray 3.7's handling of gamma, and the scene would be brighter."""
    text = """
    camera { location -5 * z look_at 0 } light_source { <5, 5, -5> 1 }
    sphere { 0, 1 pigment { rgb <0.5, 0.3, 0.2> } }
    """
    without, _ = render_text(text, tmp_path)
    included, messages = render_text(ALL + text, tmp_path)
    assert "This scene did not contain a #version directive" in messages
    assert without.max() > 0.05
    assert np.array_equal(included, without)


def test_macros_of_the_user_do_not_break_those_of_the_library(tmp_path: Path) -> None:
    """POV-Ray expands a macro wherever its name stands, even after #local."""
    names = {name.strip("_") for include in INCLUDES for name in LOCAL.findall(include.read_text())}
    assert {"Row", "Sag"} <= names
    macros = "".join(f'#macro {name}() #error "the user\'s {name} was called" #end\n' for name in sorted(names))
    render_text("#version 3.7;\n" + macros + ALL + CALLS + STAND_IN, tmp_path)
    render_text("#version 3.7;\n" + ALL + macros + CALLS + STAND_IN, tmp_path)


@pytest.mark.parametrize(
    "include", [one for one in INCLUDES if TUNABLE.search(one.read_text())], ids=lambda include: include.stem
)
def test_what_is_declared_before_the_include_stays(include: Path, tmp_path: Path) -> None:
    numbers = [name for name, _, end in TUNABLE.findall(include.read_text()) if end == ";"]
    declared = "".join(f"#declare {name} = {7 + place};\n" for place, name in enumerate(numbers))
    text = f'#version 3.7;\n{declared}#include "lippmann/{include.name}"\n'
    assert evaluate(tmp_path, text, "0", *numbers) == [0, *range(7, 7 + len(numbers))]


def test_every_number_that_is_declared_in_an_include_can_be_overridden() -> None:
    for include in INCLUDES:
        text = include.read_text()
        declared = set(re.findall(r"#declare (Lippmann_\w+)", text))
        tunable = {name for name, _, _ in TUNABLE.findall(text)}
        guard = {f"Lippmann_{include.stem.title()}_Inc"}
        assert declared == tunable | guard, include.name


def test_overrides_change_what_the_macros_make(tmp_path: Path) -> None:
    text = """#version 3.7;
    #declare Lippmann_Overlap = 0.5;
    #declare Lippmann_Overlap_Fraction = 0.1;
    #declare Lippmann_Edge_Thickness = 3;
    #include "lippmann/imaging_lens.inc"
    #declare Surfaces = Lippmann_Plano_Convex(100, 60, 1.5);
    """
    sag_mm = 50 - math.sqrt(50**2 - 30**2)
    expressions = "Lippmann_Overlap_Of(100, 50)", "Lippmann_Overlap_Of(1, 9)", "Surfaces[0][1]"
    assert evaluate(tmp_path, text, *expressions) == pytest.approx([0.5, 0.1, sag_mm + 3])


def test_a_texture_of_the_user_takes_the_place_of_black(tmp_path: Path) -> None:
    red = "#declare Lippmann_Black = texture { pigment { rgb x } finish { ambient 0 diffuse 0 emission 1 } }\n"
    scene = '#version 3.7;\n{}#include "lippmann/imaging_lens.inc"\nobject {{ Lippmann_Stop_Plate(0, 0, 1e3) }}\n'
    picture, _ = render_text(scene.format(red) + STAND_IN, tmp_path)
    assert np.allclose(picture, [1, 0, 0])
    picture, _ = render_text(scene.format("") + STAND_IN, tmp_path)
    assert not picture.any()


def test_the_dispersion_of_an_abbe_number_is_that_of_python(tmp_path: Path) -> None:
    glasses = [(1.5168, 64.17), (1.7847, 25.76), (1.7, 12.0)]
    expressions = [f"Lippmann_Dispersion({index}, {abbe})" for index, abbe in glasses]
    found = evaluate(tmp_path, '#version 3.7; #include "lippmann/glass.inc"', *expressions)
    assert found == pytest.approx([povray_dispersion(*glass) for glass in glasses], abs=1e-11)


def test_a_plano_convex_lens_has_the_focal_length_that_was_asked_for(tmp_path: Path) -> None:
    """The image of a far point is one back focal length behind the lens, which is f - d / n."""
    text = '#version 3.7; #include "lippmann/imaging_lens.inc"\n#declare Lens = Lippmann_Plano_Convex(100, 60, 1.5);'
    image_mm, thickness_mm = evaluate(tmp_path, text, "Lippmann_Image_Z(Lens, 1e9)", "Lens[0][1]")
    assert image_mm == pytest.approx(100 + thickness_mm - thickness_mm / 1.5, abs=1e-4)
    assert thickness_mm == pytest.approx(11)


def test_the_image_of_the_papers_lens_is_where_python_computes_it(tmp_path: Path) -> None:
    optical_bench = bench(small_job("fish").rig, reference_mm=1000.0)
    example = (LIBRARY / "examples" / "capture.pov").read_text()
    (surfaces,) = re.findall(r"^#declare Surfaces = .*?^};", example, re.MULTILINE | re.DOTALL)
    text = f'#version 3.7; #include "lippmann/imaging_lens.inc"\n{surfaces}'
    (image_mm,) = evaluate(tmp_path, text, "Lippmann_Image_Z(Surfaces, 1000)")
    assert image_mm == pytest.approx(optical_bench.mla_z_mm + 40.0, abs=0.005)


@pytest.mark.parametrize(
    ("what", "arguments"),
    [("Microlens_Array_Square", "2, 2, 1, 1.2, 1.5, 0"), ("Plano_Convex", "100, 100, 1.5")],
    ids=["microlenses", "imaging lens"],
)
def test_a_lens_wider_than_its_sphere_is_refused_in_numbers(what: str, arguments: str, tmp_path: Path) -> None:
    text = f"#version 3.7;\n{ALL}#declare Lens = Lippmann_{what}({arguments});\n{STAND_IN}"
    (tmp_path / "scene.pov").write_text(text)
    result = run_povray(tmp_path, ["povray", "+Iscene.pov", f"+L{LIBRARY.parent}", "+W8", "+H8"])
    assert result.returncode == 1
    message = " ".join(result.stderr.split())
    assert re.search(r"expected .* 2 \* \(Index - 1\) \* Focal_Length = \d+\.\d{4} mm, got \d+\.\d{4} mm", message)


BY_DATA_SHEET = """#version 3.7;
#include "lippmann/lens_array.inc"
#include "lippmann/capture.inc"
object {{ Lippmann_Microlens_Array_{lattice}({rows}, {cols}, 1.5, 5, 1.49, {aperture}) translate 10 * z }}
camera {{ Lippmann_Camera_{lattice}({rows}, {cols}, 1.5, 10) }}
"""
BY_SHAPE = """#version 3.7;
#include "lippmann/lens_array.inc"
#include "lippmann/capture.inc"
object {{
  Lippmann_Lens_Array_{lattice}({rows}, {cols}, 1.5, {radius!r}, {displacement!r}, 1.49) translate 10 * z
}}
camera {{ Lippmann_Orthographic({width!r}, {height!r}, 10, 20) }}
"""
LETTER = """
global_settings { assumed_gamma 1 max_trace_level 10 }
background { rgb <0.5, 0.7, 1> }
plane { -z, 500 pigment { checker rgb <1, 0.5, 0> rgb <0, 0.3, 0.1> scale 70 } finish { ambient 0 emission 1 } }
"""


@pytest.mark.parametrize("aperture", ["full", "inscribed"])
@pytest.mark.parametrize(("lattice", "count"), [("square", (5, 7)), ("hexagonal", (5, 7)), ("hexagonal", (1, 7))])
def test_an_array_by_its_data_sheet_is_the_one_that_the_farm_builds(
    lattice: str, count: tuple[int, int], aperture: str, tmp_path: Path
) -> None:
    array = LensArray.model_validate(
        {"lattice": lattice, "count": count, "aperture": aperture, "pitch_mm": 1.5, "focal_length_mm": 5.0}
    )
    shape, (width_mm, height_mm) = microlens(array), extent_mm(array)
    fields = {"lattice": lattice.title(), "rows": count[0], "cols": count[1]}
    asked = BY_DATA_SHEET.format(**fields, aperture=1.5 if aperture == "inscribed" else 0)
    built = BY_SHAPE.format(
        **fields,
        radius=shape.radius_mm,
        displacement=shape.displacement_mm,
        width=width_mm,
        height=height_mm,
    )
    found, _ = render_text(asked + LETTER, tmp_path, cols=70, rows=50)
    expected, _ = render_text(built + LETTER, tmp_path, cols=70, rows=50)
    assert expected.std() > 0.1
    assert (np.abs(found - expected) > 1e-3).mean() < 0.002
    (thickness_mm,) = evaluate(tmp_path, asked.replace("object {", "#declare Array = object {"), "max_extent(Array).z")
    assert thickness_mm - 10 == pytest.approx(shape.thickness_mm, abs=1e-6)
