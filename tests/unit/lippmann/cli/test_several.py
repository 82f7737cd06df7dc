"""One action on several jobs."""

from __future__ import annotations

import json
from typing import Any

import pytest
import typer

from lippmann.cli.several import act_on_each
from lippmann.client.errors import Refused, refusal
from lippmann.errors import BadInput, Unreachable
from lippmann.terminal.output import Output

JSON = Output(as_json=True)


def _act(name: str) -> tuple[Any, str]:
    if name.startswith("bad"):
        raise refusal(404, "", {"detail": f"there is no job {name!r}"})
    if name == "secret":
        raise refusal(401, "", {"detail": "no key"})
    if name == "gone":
        raise Unreachable("expected a service")
    if name == "ctrl-c":
        raise KeyboardInterrupt
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


@pytest.mark.parametrize(("last", "kind"), [("secret", Refused), ("gone", Unreachable), ("ctrl-c", KeyboardInterrupt)])
def test_what_was_done_before_an_error_is_printed(
    last: str, kind: type[BaseException], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(kind):
        act_on_each(["a", last, "b"], _act, JSON)
    with pytest.raises(kind):
        act_on_each(["a", last, "b"], _act, Output(as_json=False))
    assert capsys.readouterr().out.splitlines() == ['[{"id": "a"}]', "a done"]


@pytest.mark.parametrize("last", ["a/tasks", ""])
def test_names_are_checked_before_the_first_action(last: str, capsys: pytest.CaptureFixture[str]) -> None:
    done: list[str] = []

    def act(name: str) -> tuple[Any, str]:
        done.append(name)
        return _act(name)

    with pytest.raises(BadInput, match="expected an id or a name of letters"):
        act_on_each(["a", last], act, JSON)
    assert (done, capsys.readouterr().out) == ([], "")
