"""Paths are bytes: every command works with a path that is not UTF-8, or refuses it with one line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.cli import main
from lippmann.cli.exit_codes import ExitCode
from lippmann.terminal.output import json_text
from povtemplates.catalogue import scene_folders
from tests.repository import ROOT
from tests.unit.lippmann.cli.test_main import COMMANDS
from tests.unit.lippmann.local.masters import master_of, rig_of
from worker.images.write import write_png

ODD = os.fsdecode(b"caf\xe9")
"""The name of a folder and of files, in ISO 8859-1."""
NOWHERE = ("--url", "http://127.0.0.1:1", "--key", "k")

FARM = {("up",), ("demo",), ("serve",), ("worker",)}
"""tests/integration/lippmann/test_up.py runs a farm in such a data folder."""
OPERATION = {("backup",), ("restore",), ("migrate",), ("doctor",), ("keys", "admin")}
"""These open the data folder themselves, and need no farm that answers."""
SLOW = {("coding-study",), *(path for path in COMMANDS if path[0] == "paper")}
"""The options of these write what other commands write, and they take long."""

CASES: Sequence[tuple[str, ExitCode]] = (
    ("view {master} --centre --out {odd}/view.png", ExitCode.DONE),
    ("view {folder} --centre --out {odd}/view-2.png", ExitCode.DONE),
    ("refocus {master} --depth-mm 5 --out {odd}/refocused.png", ExitCode.DONE),
    ("refocus {master} --stack 0:2:2 --out {odd}/stack", ExitCode.DONE),
    ("observe {master} --eye 0,0,500 --size 32 --rays 1 --out {odd}/eye.png", ExitCode.DONE),
    ("depth {master} --out {odd}/depth.exr", ExitCode.DONE),
    ("export {master} quilt.png npz.npz --out {odd}/exports", ExitCode.DONE),
    ("compare {master} {master}", ExitCode.DONE),
    ("orthoscopic {capture} --px-per-lens 8 --lenses 20x21 --out {odd}/upright.exr", ExitCode.DONE),
    ("import {capture} --pitch-px 8 --out {odd}/imported --bundle {odd}/bundle", ExitCode.DONE),
    ("import {capture} --find-from {odd}/white.png --out {odd}/imported", ExitCode.BAD_INPUT),
    ("import {capture} --pitch-px 8 --white {odd}/none.png --out {odd}/imported", ExitCode.BAD_INPUT),
    ("design {job} --svg {odd}/bench.svg", ExitCode.DONE),
    ("design --scene {odd}/scene", ExitCode.DONE),
    ("lens {odd}/lens.json", ExitCode.DONE),
    ("lens {odd}/none.zmx", ExitCode.BAD_INPUT),
    ("lens {odd}/lens.json --catalogue {odd}/none.agf", ExitCode.BAD_INPUT),
    ("calibration-sheet --dpi 300 --out {odd}/strips.tif", ExitCode.DONE),
    ("calibration-sheet --dpi 300 --out {odd}/strips.pdf", ExitCode.DONE),
    ("capture {odd}/broken-scene --out {odd}/captured", ExitCode.BAD_INPUT),
    ("capture --job {odd}/none.json", ExitCode.BAD_INPUT),
    ("preview {odd}/broken-scene --out {odd}/previewed", ExitCode.BAD_INPUT),
    ("submit {job} {nowhere}", ExitCode.UNREACHABLE),
    ("scenes init {odd}/none.pov", ExitCode.BAD_INPUT),
    ("docs --no-open --out {odd}/pages", ExitCode.DONE),
    ("scenes upload {odd}/scene {nowhere}", ExitCode.UNREACHABLE),
    ("scenes upload {odd}/broken-scene {nowhere}", ExitCode.BAD_INPUT),
    ("scenes upload {odd}/scene --name {name} {nowhere}", ExitCode.BAD_INPUT),
    ("scenes show {name} {nowhere}", ExitCode.BAD_INPUT),
    ("fetch {name} --out {odd}/fetched {nowhere}", ExitCode.BAD_INPUT),
    ("keys create {name} {nowhere}", ExitCode.BAD_INPUT),
    ("keys create w --worker --out {odd}/lens.json {nowhere}", ExitCode.BAD_INPUT),
    ("keys create w --worker --out {odd}/w --redis-password-file {odd}/p {nowhere}", ExitCode.UNREACHABLE),
    ("keys create w --worker --out {odd}/w --s3-access-key-file {odd}/k {nowhere}", ExitCode.UNREACHABLE),
    ("backup {odd}/backup --data-dir {odd}/none", ExitCode.BAD_INPUT),
    ("restore {odd}/none --data-dir {odd}/restored", ExitCode.BAD_INPUT),
    ("doctor --data-dir {odd}/none", ExitCode.BAD_INPUT),
)


@pytest.fixture(scope="module")
def odd(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose name is not UTF-8, with an input for every command."""
    folder = tmp_path_factory.mktemp("paths") / ODD
    folder.mkdir()
    master_of(folder, rig_of())
    write_png(folder / f"{ODD}.png", _grey(168, 160))
    (folder / "job.json").write_text('{"scene": "fish"}')
    glass = {"radius_mm": 300, "thickness_mm": 30, "material": "BK7", "semi_aperture_mm": 60}
    (folder / "lens.json").write_text(
        json.dumps({"surfaces": [glass, {"radius_mm": -300, "index": 1, "semi_aperture_mm": 60}]})
    )
    for name in ("scene", "broken-scene"):
        (folder / name).mkdir()
        (folder / name / "scene.inc").write_text("background { rgb 1 }")
        (folder / name / "scene.toml").write_bytes((scene_folders()["target-white"] / "scene.toml").read_bytes())
    (folder / "broken-scene" / f"{ODD}.inc").write_text("")
    return folder


@pytest.mark.parametrize(("line", "code"), CASES, ids=lambda value: value if isinstance(value, str) else "")
def test_a_path_that_is_not_utf_8_gives_a_result_or_one_line(
    line: str, code: ExitCode, odd: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(odd)
    monkeypatch.setattr(sys, "argv", ["lippmann", *_arguments(line, odd), "--json"])
    with pytest.raises(SystemExit) as ended:
        main.main()
    printed = capfd.readouterr()
    assert int(ended.value.code or 0) == code, printed.err
    if code is ExitCode.DONE:
        for path in _paths(json.loads(printed.out)):
            assert os.path.exists(os.fsencode(path)), path
    else:
        assert printed.err.splitlines()[-1].startswith("lippmann: ")


@pytest.mark.parametrize(
    "path",
    [
        path
        for path, command in COMMANDS.items()
        if path not in FARM | OPERATION | SLOW and "data_dir" in {parameter.name for parameter in command.params}
    ],
    ids=" ".join,
)
def test_a_data_folder_that_is_not_utf_8_is_looked_into(
    path: tuple[str, ...], odd: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    inputs = {
        "jobs": "",
        "workers": "",
        "list": "",
        "audit": "",
        "create": "alice",
        "export": "1m8j90emqdeyfg978 quilt.png",
    }
    inputs |= {"upload": "{odd}/scene", "submit": "{job}", "view": "1m8j90emqdeyfg978 --centre --out x.png"}
    inputs |= {"refocus": "1m8j90emqdeyfg978 --depth-mm 1 --out x.png", "depth": "1m8j90emqdeyfg978 --out x.png"}
    inputs |= {"observe": "1m8j90emqdeyfg978 --eye 0,0,500 --out x.png"}
    inputs |= {"status": "", "top": "", "priority": "1m8j90emqdeyfg978 80"}
    inputs |= {"webhook-secret": "", "usage": "", "keys link": "", "link": "1m8j90emqdeyfg978 job.json"}
    line = inputs.get(" ".join(path), inputs.get(path[-1], "1m8j90emqdeyfg978"))
    monkeypatch.setattr(sys, "argv", ["lippmann", *path, *_arguments(line, odd), "--data-dir", str(odd / "data")])
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == ExitCode.UNREACHABLE
    assert "got no " in capsys.readouterr().err


def test_every_option_that_takes_a_path_is_tried() -> None:
    untried, count = [], 0
    for path, command in COMMANDS.items():
        lines = [line.split() for line, _ in CASES if line.split()[: len(path)] == list(path)]
        for parameter in command.params:
            if "Path" in str(parameter.bare_type()) and parameter.name != "data_dir" and path not in FARM | SLOW:
                count += 1
                option = parameter.opts[0]
                if not lines or (option.startswith("--") and not any(option in line for line in lines)):
                    untried.append((path, option))
    assert not untried
    assert count > 20


def test_a_path_is_printed_byte_for_byte_and_as_json_in_utf_8(odd: Path) -> None:
    command = [sys.executable, "-P", "-m", "lippmann.cli.main", *_arguments("view {master} --centre --out", odd)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"}
    target = str(odd / "printed.png")
    text = subprocess.run([*command, target], capture_output=True, check=True, env=environment)
    assert text.stdout == os.fsencode(target) + b"\n"
    as_json = subprocess.run([*command, target, "--json"], capture_output=True, check=True, env=environment)
    assert json.loads(as_json.stdout.decode("utf-8"))["file"] == target


def _arguments(line: str, odd: Path) -> list[str]:
    values: Mapping[str, Sequence[str]] = {
        "{master}": [str(odd / "orthoscopic" / "0001.exr")],
        "{folder}": [str(odd)],
        "{capture}": [str(odd / f"{ODD}.png")],
        "{job}": [str(odd / "job.json")],
        "{name}": [ODD],
        "{nowhere}": NOWHERE,
    }
    return [one for word in line.split() for one in values.get(word, [word.replace("{odd}", str(odd))])]


def _paths(result: Any) -> list[str]:
    """Return every text in a result that is an absolute path."""
    if isinstance(result, str):
        return [result] if result.startswith("/") else []
    parts = result.values() if isinstance(result, dict) else result if isinstance(result, list) else ()
    return [path for part in parts for path in _paths(part)]


def _grey(rows: int, cols: int) -> Any:
    return np.full((rows, cols, 3), 0.2, dtype=np.float32)


def test_json_text_is_utf_8_and_gives_back_every_path() -> None:
    data = {"file": f"/{ODD}", "title": "äß", "count": 3}
    text = json_text(data)
    assert json.loads(text.encode("utf-8")) == data
    assert "äß" in text
