"""Data sets as a job asks for them: what cannot be is refused by the option that asks for it."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.outputs.datasets import HciFolder, LensletVideo, NpzArrays, SubapertureViews
from tests.builders import small_job


def test_the_short_spellings_are_the_names_of_folders_and_files() -> None:
    outputs = small_job("fish", outputs=["hci", "subaperture_ppm", "mpeg_lenslet", "npz.npz"]).outputs
    assert outputs == (HciFolder(), SubapertureViews(), LensletVideo(), NpzArrays())


@pytest.mark.parametrize(
    ("output", "rig", "field", "expected"),
    [
        ({"kind": "subaperture_ppm", "views": [9, 8]}, {}, "outputs.1.views", "at most 8 x 8 views"),
        ({"kind": "npz", "views": [0, 1]}, {}, "outputs.1.views.0", "a number of at least 1"),
        ({"kind": "hci", "views": [8, 9]}, {}, "outputs.1.views", "at most 8 x 8 views"),
        (
            {"kind": "hci", "views": [7, 7]},
            {"lens_array": {"lattice": "hexagonal"}},
            "outputs.1.views",
            "exist under a hexagonal lens, as 5 x 5",
        ),
        ({"kind": "hci", "disparity": "truth"}, {}, "outputs.1.disparity", "a job with capture.depth true"),
        ({"kind": "hci"}, {"px_per_lens": 40}, "outputs.1.views", "at most 1000 views"),
        ({"kind": "mpeg_lenslet", "sequence": "a/b"}, {}, "outputs.1.sequence", "letters, digits and dashes"),
        ({"kind": "mpeg_lenslet", "sequence": "../up"}, {}, "outputs.1.sequence", "letters, digits and dashes"),
        ({"kind": "mpeg_lenslet", "convention": "upside-down"}, {}, "outputs.1.convention", "orthoscopic"),
        ({"kind": "npz", "dtype": "float64"}, {}, "outputs.1.dtype", "float16"),
        ({"kind": "hci", "name": "a b"}, {}, "outputs.1.name", "lower-case letters, digits, dashes"),
    ],
)
def test_what_cannot_be_is_refused_by_name(
    output: dict[str, Any], rig: dict[str, Any], field: str, expected: str
) -> None:
    with pytest.raises(SpecError) as raised:
        small_job("fish", outputs=["views.mp4", output], **rig)
    (problem,) = raised.value.problems
    assert problem.field == field
    assert expected in problem.expected


def test_a_hexagonal_lens_may_leave_views_out_where_a_format_has_a_place_for_it() -> None:
    job = small_job("fish", lens_array={"lattice": "hexagonal"}, outputs=[{"kind": "npz", "views": [11, 8]}])
    assert len(job.outputs) == 1
