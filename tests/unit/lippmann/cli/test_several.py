"""One action on several jobs."""

from __future__ import annotations

import json
from typing import Any

import pytest
import typer

from lippmann.cli.several import act_on_each
from lippmann.client.errors import Refused, refusal
from lippmann.terminal.output import Output

JSON = Output(as_json=True)


def _act(name: str) -> tuple[Any, str]:
    if name.startswith("bad"):
        raise refusal(404, "", {"detail": f"there is no job {name!r}"})
    if name == "secret":
        raise refusal(401, "", {"detail": "no key"})
    return {"id": name}, f"{name} done"


def test_one_id_gives_its_result_and_several_a_list(capsys: pytest.CaptureFixture[str]) -> None:
    act_on_each(["a"], _act, JSON)
    act_on_each(["a", "b", "a"], _act, JSON)
    act_on_each(["a", "b"], _act, Output(as_json=False))
    one, several, *lines = capsys.readouterr().out.splitlines()
    assert (json.loads(one), json.loads(several)) == ({"id": "a"}, [{"id": "a"}, {"id": "b"}])
    assert lines == ["a done", "b done"]


def test_a_refusal_keeps_nobody_from_the_other_ids(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit) as ended:
        act_on_each(["bad1", "a", "bad2"], _act, JSON)
    assert ended.value.exit_code == 1
    said = capsys.readouterr()
    assert json.loads(said.out) == [{"id": "a"}]
    assert said.err.splitlines() == [f"lippmann: {bad}: there is no job '{bad}'" for bad in ("bad1", "bad2")]


@pytest.mark.parametrize("names", [["bad"], ["a", "secret", "b"]])
def test_the_only_refusal_and_a_missing_key_are_raised(names: list[str]) -> None:
    with pytest.raises(Refused):
        act_on_each(names, _act, JSON)
