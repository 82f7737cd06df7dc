"""Which variables a scene may read: a word in a comment is not read, and whatever is in doubt counts."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.job.scenes.scene import SCENE_FILE
from povtemplates.catalogue import INCLUDE_FOLDER, scene_folders
from worker.engines.povray.scenes.scene_variables import SceneVariables, scene_variables


def variables(folder: Path, text: str | bytes, name: str = "scene.inc") -> SceneVariables:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return scene_variables(folder)


@pytest.mark.parametrize(
    "text",
    [
        "sphere { 0, clock }",
        "#declare Turn=clock*8;",
        "// a comment\rsphere { 0, clock }",
        "/* one */ sphere { 0, clock } /* two */",
        "/* a /* nested */ sphere { 0, clock } */",
        '#debug "http://here" sphere { 0, clock }',
        '#debug "/*" sphere { 0, clock } #debug "*/"',
        '// it begins "here /*\nsphere { 0, clock }\n// */',
        '#write (F, "#declare A = clock;")',
        "/* not closed: clock",
    ],
)
def test_a_scene_that_may_read_the_clock_counts(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text).clock


@pytest.mark.parametrize(
    "text",
    [
        "sphere { 0, 1 }",
        "// the clock\nsphere { 0, 1 } // now",
        "/* the clock\n strikes */ sphere { 0, 1 }",
        "#declare Clockwork = clock_radius + o_clock;",
        "#declare Snow = 1; #declare Nowhere = 2;",
    ],
)
def test_comments_and_longer_names_do_not_count(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text) == SceneVariables(clock=False, now=False)


def test_every_file_that_may_be_included_counts_whatever_its_name(tmp_path: Path) -> None:
    assert not variables(tmp_path, '#include "parts/legs.dat"').clock
    assert variables(tmp_path, "#declare Leg = clock;", "parts/legs.dat").clock


def test_a_scene_with_zeros_at_its_end_counts(tmp_path: Path) -> None:
    assert variables(tmp_path, b"sphere { 0, clock }\x1a\0\0", "Scene.POV").clock


def test_pictures_and_the_manifest_do_not_count(tmp_path: Path) -> None:
    variables(tmp_path, "[clock]\nfirst = 0\n# now", "scene.toml")
    variables(tmp_path, "The clock stands now.", "README.md")
    assert variables(tmp_path, b"P\0\1 now clock ", "picture.tga") == SceneVariables(clock=False, now=False)


def test_the_time_of_day_is_told_from_the_clock(tmp_path: Path) -> None:
    assert variables(tmp_path, "#declare S = seed(now * 1e6);") == SceneVariables(clock=False, now=True)


@pytest.mark.parametrize("name", ["frame_number", "final_frame", "initial_clock", "clock_delta"])
def test_the_variables_of_an_animation_are_told_from_the_clock(tmp_path: Path, name: str) -> None:
    assert variables(tmp_path, f"sphere {{ 0, {name} }}") == SceneVariables(clock=False, now=False, frames=True)


@pytest.mark.parametrize(
    "text",
    [
        "light_source { 0, 1 area_light x, y, 2, 2 jitter }",
        "interior { media { scattering { 1, 1 } } }",
        "finish { crand 0.1 }",
        "global_settings { radiosity { } }",
        '#include "stones.inc"',
        '#include "Textures.inc"',
    ],
)
def test_a_scene_that_povray_samples_at_random_is_known(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text).chance
    assert not variables(tmp_path, 'no_radiosity #declare Media_Count = rand(S); #include "colors.inc"').chance


@pytest.mark.parametrize(
    "text",
    ['#fopen F "state.txt" write', '# fopen F concat("a", "b")\nappend', 'photons { save_file "a.ph" }'],
)
def test_a_scene_that_opens_files_for_writing_is_known_by_the_files_that_do(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text, "parts/state.inc").writes == ("parts/state.inc",)


def test_reading_a_file_and_writing_in_a_comment_count_as_no_writing(tmp_path: Path) -> None:
    text = '#fopen F "state.txt" read\n#read (F, Append)\n// #fopen F Name write\n#declare write_it = 1;'
    assert variables(tmp_path, text).writes == ()


@pytest.mark.parametrize("text", ["camera { location 0 }", '#include "Screen.inc"', "#declare C = camera { Eye }"])
def test_a_scene_that_may_have_a_camera_is_known(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text).has_camera("scene.inc")
    assert not variables(tmp_path, "#declare Camera_Angle = 3; // camera").has_camera("scene.inc")


def test_the_camera_of_a_scene_file_that_nothing_includes_does_not_count(tmp_path: Path) -> None:
    variables(tmp_path, "camera { location 0 }", "preview.pov")
    assert not variables(tmp_path, "sphere { 0, 1 }").has_camera("scene.inc")
    assert variables(tmp_path, '#include "preview.pov"').has_camera("scene.inc")


def test_the_fish_reads_the_clock_and_the_targets_and_our_includes_read_nothing() -> None:
    folders = {name: folder for name, folder in scene_folders().items() if (folder / SCENE_FILE).is_file()}
    found = {name: scene_variables(folder) for name, folder in folders.items()}
    fish = found.pop("fish")
    assert (fish.clock, fish.now, fish.has_camera("scene.inc"), fish.chance) == (True, False, False, False)
    for nothing in (*found.values(), scene_variables(INCLUDE_FOLDER)):
        assert (nothing.clock, nothing.now, nothing.has_camera("scene.inc")) == (False, False, False)


def test_a_file_that_changes_is_read_anew(tmp_path: Path) -> None:
    assert not variables(tmp_path, "sphere { 0, 1 }").clock
    assert variables(tmp_path, "sphere { 0, clock }").clock
    (tmp_path / "scene.inc").unlink()
    assert not scene_variables(tmp_path).clock


def test_texts_for_people_are_no_camera_and_write_no_file(tmp_path: Path) -> None:
    text = 'Its camera is dropped, and #fopen F "state.txt" write keeps the state.'
    assert variables(tmp_path, text, "README") == SceneVariables(clock=False, now=False)
    assert variables(tmp_path, text, "a/camera.txt").writes == ("a/camera.txt",)


@pytest.mark.parametrize("text", ['#include "screen.inc"', '#include "stdcam"', '#include "Stage1.inc"', "camera { }"])
def test_a_camera_of_an_include_of_povray_counts(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text).cameras == ("scene.inc",)


def test_names_of_pov_files_are_found_in_quotation_marks(tmp_path: Path) -> None:
    text = '#include "a/B.pov" #include "c\\d.POV" // "e.pov"\n#include ".pov" f.pov ' + "g" * 300 + '.pov"'
    assert variables(tmp_path, text).included == {"b.pov", "d.pov", "e.pov", ".pov", "g" * 200 + ".pov"}


@pytest.mark.parametrize("text", ["/* " * 100_000 + "#", "#" + "x" * 3_000_000, "/*/ clock"])
def test_a_text_of_any_kind_is_looked_through_once(tmp_path: Path, text: str) -> None:
    assert variables(tmp_path, text).clock == ("clock" in text)
