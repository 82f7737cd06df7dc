"""The command as others see it: exit codes, help, documentation."""

from __future__ import annotations

import errno
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, get_args

import pytest
import typer.main
from typer.testing import CliRunner

from lippmann import errors
from lippmann.cli import main, options
from lippmann.cli.exit_codes import ExitCode
from lippmann.client.errors import refusal
from lippmann.errors import BundleError, RenderFailed, SpecError
from lippmann.job.states import JobStatus, TaskStatus
from tests.repository import ROOT

HEAVY = (
    "numpy", "scipy", "celery", "fastapi", "httpx", "pydantic", "sqlalchemy", "OpenImageIO", "av", "tifffile",
    "reportlab", "redis", "matplotlib",
)  # fmt: skip


def _commands(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, command in group.commands.items():
        if command.hidden:
            continue
        if hasattr(command, "commands"):
            yield from _commands(command, (*path, name))
        else:
            yield (*path, name), command


COMMANDS = dict(_commands(typer.main.get_command(main.app)))


def test_a_mistyped_output_is_found_before_a_service_is_asked_for_frames(tmp_path: Path) -> None:
    ran = CliRunner().invoke(main.app, ["export", "job", "quilt.pgn", "--data-dir", str(tmp_path)])
    assert isinstance(ran.exception, SpecError)
    assert "did you mean quilt.png?" in ran.exception.message


def test_there_are_the_commands_that_were_promised() -> None:
    farm = {"up", "serve", "worker", "workers", "top", "status", "demo", "keys"}
    jobs = {"submit", "jobs", "show", "tasks", "watch", "fetch", "cancel", "pause", "resume", "retry", "repair", "skip"}
    jobs |= {"link", "logs", "rm", "priority"}
    integral = {"import", "view", "refocus", "observe", "export", "coding-study", "orthoscopic", "depth"}
    optics = {"design", "lens", "paper", "calibration-sheet"}
    care = {"backup", "restore", "migrate", "doctor", "docs"}
    assert {path[0] for path in COMMANDS} == farm | care | jobs | integral | optics | {
        "scenes",
        "capture",
        "preview",
        "compare",
    }


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_command_is_documented_with_an_example_and_speaks_json(path: tuple[str, ...]) -> None:
    assert f"`lippmann {' '.join(path)}" in (ROOT / "docs" / "command.md").read_text()
    assert COMMANDS[path].help
    options = {option for parameter in COMMANDS[path].params for option in parameter.opts}
    assert "--json" in options


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_help_text_is_made_of_whole_sentences(path: tuple[str, ...]) -> None:
    command = COMMANDS[path]
    texts = [command.help, *(parameter.help for parameter in command.params if not getattr(parameter, "hidden", False))]
    for text in filter(None, texts):
        assert re.fullmatch(r"[A-Z].*[.]", text.strip(), re.DOTALL), text
        assert not re.match(r"(Of|From|Where|By|As|Likewise|Which|With|To|In|At|On)\b", text), text
    assert all(texts), "every option has a help text"


@pytest.mark.parametrize("code", ExitCode)
def test_every_exit_code_is_documented(code: ExitCode) -> None:
    assert f"\n| {int(code)} | " in (ROOT / "docs" / "command.md").read_text()
    assert f"\n{int(code)} " in (main.__doc__ or "")


def test_help_imports_nothing_heavy() -> None:
    program = (
        "import sys\nsys.argv = ['lippmann', '--help']\nfrom lippmann.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert run.stdout.splitlines()[-1] == "[]"


def test_the_package_hands_out_its_client_late() -> None:
    program = "import sys, lippmann\nassert 'httpx' not in sys.modules\nprint(lippmann.Client.__name__)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert run.stdout == "Client\n"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.BadInput("x"), 2),
        (errors.Unreachable("x"), 3),
        (errors.NotAllowed("x"), 4),
        (errors.JobEnded("x"), 1),
        (refusal(401, "", None), 4),
        (refusal(403, "", None), 4),
        (refusal(404, "", None), 1),
        (refusal(409, "", None), 1),
        (refusal(422, "", None), 2),
        (refusal(500, "", None), 1),
        (SpecError("x"), 2),
        (BundleError("x"), 2),
        (RenderFailed("x"), 1),
        (KeyboardInterrupt(), 130),
        (OSError(errno.ENOSPC, "No space left on device", "out/0001.png"), 1),
        (OSError(errno.EIO, "Input/output error"), 1),
        (NotADirectoryError(errno.ENOTDIR, "Not a directory", "out/0001.png"), 1),
        (OSError(), 1),
    ],
    ids=lambda value: repr(value)[:40],
)
def test_an_error_becomes_one_line_and_its_exit_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(main, "app", _raising(error))
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == code
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"lippmann: .+\n", said.err)


def test_a_fault_of_ours_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(main, "app", _raising(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        main.main()


def test_a_problem_names_every_field() -> None:
    fields = [{"field": "frames", "expected": "a", "got": "b"}, {"field": "fps", "expected": "c", "got": "d"}]
    error = refusal(422, "", {"detail": "2 fields are wrong", "code": "spec", "errors": fields})
    assert error.message == "frames: expected a, got b; fps: expected c, got d"
    assert (error.code, len(error.problems)) == ("spec", 2)


def test_an_answer_that_is_no_problem_says_its_status() -> None:
    assert refusal(502, "Bad Gateway", None).message == "expected an answer of a Lippmann service, got 502 Bad Gateway"
    assert refusal(500, "Oh", ["not", "an", "object"]).status == 500


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["nonsense"], 2, "nonsense"),
        (["shwo"], 2, "Did you mean 'show'"),
        (["scenes", "shwo"], 2, "Did you mean 'show'"),
        (["jobs", "--limits", "3"], 2, "--limit"),
        (["rm"], 2, "JOB..."),
        (["priority", "a", "b", "101"], 2, "PRIORITY"),
        (["jobs", "--limit", "0"], 2, "lippmann: --limit: expected a number of at least 1, got '0' `lippmann jobs -h`"),
        (["up", "--port", "99999"], 2, "--port: expected a number of at most 65535, got '99999'"),
        (["view", "a.exr", "--out", "a.png", "--u", "left"], 2, "--u: expected a whole number, got 'left'"),
        (
            ["jobs", "--status", "over"],
            2,
            "--status: expected one of queued, probing, running, paused, done, failed, cancelled, got 'over'",
        ),
        (["keys"], 2, "Usage: lippmann keys COMMAND ..."),
        (["demo", "--frames", "6-1"], 2, "expected a range that counts up"),
        (["submit", "nowhere.json"], 2, "expected a job file, got nowhere.json"),
        (["capture"], 2, "expected a SCENE"),
        (["compare", "a.exr", "b.exr"], 2, "expected a picture or a folder of pictures, got a.exr"),
        (["compare", "a.exr", "b.exr", "--lenses", "9x9"], 2, "or neither, got only --lenses"),
        (["capture", "nowhere"], 2, "one of fish, "),
        (["capture", "fish", "--set", "rig.px_per_lens=1"], 2, "rig.px_per_lens"),
        (["capture", "fish", "--out", "/proc/out"], 2, "expected a folder that can be written, got /proc/out"),
        (["scenes", "upload", "nowhere"], 2, "expected a scene bundle"),
        (["jobs"], 3, "got no data/farm.json"),
        (["jobs", "--url", "http://127.0.0.1:1"], 4, "expected a key"),
        (["jobs", "--url", "http://127.0.0.1:1", "--key", "k"], 3, "expected a service at http://127.0.0.1:1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_is_said_with_the_right_exit_code(
    arguments: list[str], code: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["lippmann", *arguments])
    for name in ("LIPPMANN_URL", "LIPPMANN_KEY", "LIPPMANN_DATA_DIR"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == code
    assert said in " ".join(capsys.readouterr().err.split())
    left = {path.name for path in tmp_path.rglob("*")}
    assert left <= {"out"}, "nothing half-written"


def test_the_statuses_that_the_command_takes_are_all_there_are() -> None:
    assert get_args(options.JobStatusName) == tuple(JobStatus)
    assert get_args(options.TaskStatusName) == tuple(TaskStatus)


@pytest.mark.parametrize("arguments", [["-h"], ["scenes", "-h"], ["keys", "list", "-h"], ["fetch", "-h"]], ids=" ".join)
def test_the_short_option_of_help_works_everywhere(arguments: list[str]) -> None:
    ended = CliRunner().invoke(main.app, arguments)
    assert (ended.exit_code, "Usage:" in ended.stdout) == (0, True)


def test_the_command_tells_its_version() -> None:
    ended = CliRunner().invoke(main.app, ["--version"])
    assert (ended.exit_code, ended.stdout) == (0, f"lippmann {version('lippmann')}\n")


def test_a_shell_gets_the_commands_that_begin_as_the_word() -> None:
    asked = {"_LIPPMANN_COMPLETE": "complete_bash", "COMP_WORDS": "lippmann pri", "COMP_CWORD": "1"}
    ended = CliRunner().invoke(main.app, [], env=asked, prog_name="lippmann")
    assert ended.stdout.split() == ["priority"]


def test_old_names_of_a_job_file_and_of_a_command_are_noted_on_stderr(tmp_path: Path) -> None:
    (tmp_path / "job.json").write_text('{"scene": "fish", "capture": {"method": "raytraced"}}')
    command = [sys.executable, "-P", "-m", "lippmann.cli.main"]
    designed = subprocess.run([*command, "design", "job.json"], capture_output=True, text=True, cwd=tmp_path)
    assert designed.returncode == 0, designed.stderr
    assert designed.stderr == "note: capture.method raytraced is now glass; the next release refuses the old name\n"
    imported = subprocess.run([*command, "views", "nowhere.png"], capture_output=True, text=True, cwd=tmp_path)
    assert imported.returncode == 2
    assert imported.stderr.startswith("note: `lippmann views` is now `lippmann import`; ")


def test_a_machine_without_povray_renders_nothing_and_is_told_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("LIPPMANN_POVRAY", "povray-of-the-future")
    for arguments in (["worker"], ["capture", "fish"], ["demo"]):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["lippmann", *arguments])
        with pytest.raises(SystemExit) as ended:
            main.main()
        assert ended.value.code == 1
        assert "expected POV-Ray as 'povray-of-the-future' on PATH" in capsys.readouterr().err


def test_json_is_the_only_thing_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    from lippmann.terminal.output import Output

    Output(as_json=True).note("for people")
    Output(as_json=True).result({"ä": 1}, "text")
    said = capsys.readouterr()
    assert json.loads(said.out) == {"ä": 1}
    assert said.err == "for people\n"


def _raising(error: BaseException) -> Callable[..., None]:
    def app(*, standalone_mode: bool) -> None:
        raise error

    return app
