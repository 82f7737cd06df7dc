"""What a refusal of a job says: the words of whoever wrote the job file, in JSON."""

from __future__ import annotations

import re
from typing import Any

import pytest

from lippmann.errors import SpecError
from lippmann.job.spec import parse_spec

NAME = "lower-case letters, digits and dashes, with a letter or digit first"
JARGON = re.compile(
    "[Ii]nput|[Ss]tring|[Tt]uple|dictionary|valid |instance|parse|constrained|literal|None|True|False|discriminator"
    "|greater|less"
)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"frames": True}, "frames: expected text, got true"),
        ({"fps": "x"}, "fps: expected a number, got 'x'"),
        ({"fps": float("nan")}, "fps: expected a finite number, got nan"),
        ({"priority": None}, "priority: expected a whole number, got null"),
        ({"priority": 1.5}, "priority: expected a whole number, got 1.5"),
        ({"priority": "x"}, "priority: expected a whole number, got 'x'"),
        ({"scene": ""}, "scene: expected text of at least 1 character, got ''"),
        ({"scene": "Fish!"}, f"scene: expected {NAME}, got 'Fish!'"),
        ({"title": "x" * 201}, "title: expected text of at most 200 characters, got "),
        ({"parameters": 5}, "parameters: expected an object, got 5"),
        (
            {"parameters": {"hue": [1]}},
            "parameters.hue: expected true or false, a whole number, a number or text, got [1]",
        ),
        (
            {"parameters": {"tuple[": None}},
            "parameters.tuple[: expected true or false, a whole number, a number or text",
        ),
        ({"stage": 5}, "stage: expected an object, got 5"),
        ({"rig": {"lens_array": {"count": 5}}}, "rig.lens_array.count: expected a list, got 5"),
        (
            {"rig": {"lens_array": {"count": [1, 2, 3]}}},
            "rig.lens_array.count: expected a list of at most 2 items, got [1, 2, 3]",
        ),
        ({"rig": {"dispersion": "maybe"}}, "rig.dispersion: expected true or false, got 'maybe'"),
        ({"render": {"tiles": "x"}}, "render.tiles: expected 'auto' or a list, got 'x'"),
        ({"render": {"tiles": [0, 1]}}, "render.tiles.0: expected a number of at least 1, got 0"),
        ({"outputs": "views.mp4"}, "outputs: expected a list, got 'views.mp4'"),
        ({"sceen": 1}, "sceen: expected no field of this name (did you mean scene?), got 1"),
    ],
)
def test_a_refusal_says_what_was_expected_in_plain_words_and_once(change: dict[str, Any], said: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish"} | change)
    (problem,) = refused.value.problems
    assert str(problem).startswith(said)
    assert not JARGON.search(problem.expected + problem.got)


def test_a_mistyped_output_is_answered_with_the_one_that_is_meant() -> None:
    with pytest.raises(SpecError, match=r"\(did you mean views.mp4\?\), got 'vews.mp4'"):
        parse_spec({"scene": "fish", "outputs": ["vews.mp4"]})
    with pytest.raises(SpecError, match=r"\(did you mean quilt\?\), got 'qilt'"):
        parse_spec({"scene": "fish", "outputs": [{"kind": "qilt"}]})
