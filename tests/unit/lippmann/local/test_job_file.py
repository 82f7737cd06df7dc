import json
from pathlib import Path

import pytest

from lippmann.errors import BadInput, InputNote
from lippmann.local.files.job import read_job, set_field


@pytest.mark.parametrize(
    ("override", "job"),
    [
        ("rig.px_per_lens=4", {"rig": {"px_per_lens": 4}}),
        ("rig.lens_array.count=[4, 5]", {"rig": {"lens_array": {"count": [4, 5]}}}),
        ("outputs=[]", {"outputs": []}),
        ("parameters.lit=true", {"parameters": {"lit": True}}),
        ("parameters.colour=#20a0ff", {"parameters": {"colour": "#20a0ff"}}),
        ("title=a=b", {"title": "a=b"}),
        ("clock=null", {"clock": None}),
    ],
)
def test_an_override_sets_one_field_and_makes_what_is_above_it(override: str, job: object) -> None:
    made: dict[str, object] = {}
    set_field(made, override)
    assert made == job


def test_an_override_leaves_the_fields_beside_it_alone() -> None:
    job = {"rig": {"px_per_lens": 8, "imaging_lens": "x"}, "frames": "1"}
    set_field(job, "rig.px_per_lens=4")
    assert job == {"rig": {"px_per_lens": 4, "imaging_lens": "x"}, "frames": "1"}


def test_frames_are_text_even_when_they_look_like_a_number() -> None:
    job: dict[str, object] = {}
    set_field(job, "frames=5")
    assert job == {"frames": "5"}


@pytest.mark.parametrize("override", ["frames", "=4", "rig..count=1", "a.=1", ".a=1"])
def test_an_override_that_is_none_is_refused_with_the_form_that_was_expected(override: str) -> None:
    with pytest.raises(BadInput, match="expected field=value"):
        set_field({}, override)


def test_an_override_below_a_value_says_which_value_is_in_the_way() -> None:
    with pytest.raises(BadInput, match="'frames', got frames=\"1\""):
        set_field({"frames": "1"}, "frames.first=1")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "expected JSON, got .* at line 1, column 2"),
        ("[1]", r"expected a job as a JSON object, got \[1\]"),
        ("\xff", "UTF-8"),
    ],
)
def test_a_job_file_that_is_none_is_refused_by_name(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "job.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(BadInput, match=said) as caught:
        read_job(str(path))
    assert "job.json" in caught.value.message


def test_a_job_file_that_is_not_there_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"nowhere\.json: No such file"):
        read_job(str(tmp_path / "nowhere.json"))


def test_a_lens_may_be_a_file_beside_the_job(tmp_path: Path) -> None:
    (tmp_path / "lens.csv").write_text("radius;thickness;material;index;v-no;sa\n100;5;;1.5;;20\n-100;0;;1;;20\n")
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"scene": "fish", "rig": {"imaging_lens": {"file": "lens.csv"}}}))
    surfaces = read_job(str(job))["rig"]["imaging_lens"]["surfaces"]
    assert [surface["radius_mm"] for surface in surfaces] == [100, -100]


def test_a_lens_file_may_have_catalogues_and_its_notes_are_warnings(tmp_path: Path) -> None:
    (tmp_path / "own.agf").write_text("NM OWN-1 5 0 1.6 50\nCD 1.6\n")
    (tmp_path / "lens.seq").write_text("RDM\nEPD 20\nSO 0 inf\nS 100 5 OWN-1\nSTO\nS -100 90\nSI 0 0\n")
    job = tmp_path / "job.json"
    lens = {"file": "lens.seq", "catalogues": ["own.agf"]}
    job.write_text(json.dumps({"scene": "fish", "rig": {"imaging_lens": lens}}))
    with pytest.warns(InputNote, match=r"^lens\.seq: S1, S2: the semi-diameter is computed"):
        read = read_job(str(job))
    assert read["rig"]["imaging_lens"]["surfaces"][0]["index"] == 1.6
    job.write_text(json.dumps({"scene": "fish", "rig": {"imaging_lens": lens | {"catalogues": "own.agf"}}}))
    with pytest.raises(BadInput, match=r"^rig\.imaging_lens\.catalogues: expected a list of \.agf files"):
        read_job(str(job))


def test_a_lens_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    job = tmp_path / "job.json"
    job.write_text(json.dumps({"scene": "fish", "rig": {"imaging_lens": {"file": "gone.csv"}}}))
    with pytest.raises(BadInput, match=r"gone\.csv"):
        read_job(str(job))
