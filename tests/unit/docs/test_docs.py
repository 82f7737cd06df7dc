"""What the documentation says is what the code does."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import typer.main
from pydantic import BaseModel

from lippmann.cli.main import app
from lippmann.job.outputs.output import KINDS
from lippmann.job.rendering.render_settings import RenderSettings
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.job.states import JOB_ACTIONS, JOB_TRANSITIONS, TASK_TRANSITIONS
from povtemplates.catalogue import scene_folders
from service.coordinator.retry_policy import DETERMINISTIC
from service.doctor.finding import Check
from service.schemas.wait import WAITS, WaitCode
from service.settings import Settings
from tests.repository import DOCS, ROOT
from worker.settings import WorkerSettings

PAGES = sorted([*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md"])


def fields_of(model: type[BaseModel], prefix: str = "") -> set[str]:
    names = set()
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            names |= fields_of(inner, f"{prefix}{name}.")
        else:
            names.add(prefix + name)
    return names


def rows_of(page: str) -> list[list[str]]:
    lines = (DOCS / page).read_text().splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]


def test_every_field_of_a_job_is_documented_and_no_other() -> None:
    # The table of old names, on the same page, has values beside its names.
    rows = [row for row in rows_of("job-file.md") if row[0].startswith("`") and '"' not in row[0]]
    documented = {name.strip("` ") for row in rows for name in row[0].split(",")}
    assert documented == fields_of(JobSpec)


def test_the_documented_job_is_the_default_one() -> None:
    (block,) = re.findall(r"```json\n(.*?)```", (DOCS / "job-file.md").read_text(), re.DOTALL)
    spec = parse_spec(json.loads(block))
    assert spec.rig == JobSpec(scene="fish").rig
    assert spec.outputs == JobSpec(scene="fish").outputs


def test_every_kind_of_output_is_documented_with_its_options_and_no_other() -> None:
    sections = (DOCS / "outputs.md").read_text().split("\n### ")[1:]
    documented = {
        section.split("\n")[0]: set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) for section in sections
    }
    assert documented == {kind: set(options.model_fields) - {"kind"} for kind, options in KINDS.items()}


def test_the_documented_statuses_and_actions_are_those_of_the_code() -> None:
    tables: dict[str, dict[str, list[str]]] = {}
    for first, *others in rows_of("statuses.md"):
        if first in ("job", "action", "task", "why"):
            table = tables.setdefault(first, {})
        elif not first.startswith(("-", "`", "code")):
            table[first] = others
    transitions = {"job": JOB_TRANSITIONS, "task": TASK_TRANSITIONS}
    for kind, code in transitions.items():
        documented = {status: words_in(may_become) for status, (_, may_become) in tables[kind].items()}
        assert documented == {status.value: set(after) for status, after in code.items()}
    assert {action: (words_in(where), words_in(to)) for action, (where, to) in tables["action"].items()} == {
        action.value: (set(rule.allowed_in), {rule.leads_to} if rule.leads_to else set())
        for action, rule in JOB_ACTIONS.items()
    }


def test_every_reason_to_wait_is_documented_with_its_meaning_and_no_other() -> None:
    (table,) = re.findall(r"^\| why \|.*\n\|[-|]+\n((?:\|.*\n)+)", (DOCS / "statuses.md").read_text(), re.MULTILINE)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    assert rows == [[code.value, meaning] for code, meaning in WAITS.items()]
    assert set(WAITS) == set(WaitCode)


def test_the_limits_of_an_attempt_are_documented_with_their_defaults_and_the_codes_of_their_errors() -> None:
    limits = {first.strip("`"): limit for first, *_, limit in rows_of("statuses.md") if first.startswith("`")}
    assert set(limits) == DETERMINISTIC
    in_words = {"6 hours": 21600, "30 minutes": 1800, "15 minutes": 900, "10 minutes": 600, "8192 MB": 8192}
    for limit in limits.values():
        for name, words in re.findall(r"`render\.(\w+)`, (\w+ \w+)", limit):
            assert RenderSettings.model_fields[name].default == in_words[words], name


def words_in(cell: str) -> set[str]:
    return {word.strip() for word in cell.split(",")} - {"-"}


def test_every_scene_is_documented() -> None:
    documented = {row[0].strip("`") for row in rows_of("scenes.md") if row[0].startswith("`")}
    assert documented == set(scene_folders())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_inside_the_docs_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text())
    missing = [t for t in targets if not t.startswith(("http://", "https://")) and not (page.parent / t).exists()]
    assert not missing


def test_every_page_is_in_the_table_of_contents() -> None:
    contents = (DOCS / "README.md").read_text()
    assert all(page.name in contents for page in DOCS.glob("*.md") if page.name != "README.md")


@pytest.mark.parametrize(("heading", "settings"), [("The service", Settings), ("A worker", WorkerSettings)])
def test_every_setting_is_documented_and_no_other(heading: str, settings: type[BaseModel]) -> None:
    section = (DOCS / "settings.md").read_text().split(f"## {heading}\n")[1].split("\n## ")[0]
    assert set(re.findall(r"LIPPMANN_(\w+)`", section)) == {name.upper() for name in settings.model_fields}


@pytest.mark.parametrize(("heading", "settings"), [("The service", Settings), ("A worker", WorkerSettings)])
def test_the_documented_defaults_of_the_settings_are_those_of_the_code(heading: str, settings: type[BaseModel]) -> None:
    section = (DOCS / "settings.md").read_text().split(f"## {heading}\n")[1].split("\n## ")[0]
    documented = dict(re.findall(r"^\| `LIPPMANN_(\w+)` \| .* \| ([^|]*?)(?: \(\d+ \w+\))? \|$", section, re.MULTILINE))
    for name, field in settings.model_fields.items():
        if field.default_factory is None and field.default is not None:
            assert is_default(documented[name.upper()], field.default), name


def is_default(documented: str, value: object) -> bool:
    if isinstance(value, bool):
        return documented == str(value).lower()
    return float(documented) == value if isinstance(value, float) else documented == (str(value) or "-")


def test_every_variable_of_the_command_is_documented_with_its_option_and_no_other() -> None:
    section = (DOCS / "settings.md").read_text().split("## The command\n")[1].split("\n## ")[0]
    read, commands = set(), [typer.main.get_group(app)]
    while commands:
        command = commands.pop()
        commands += getattr(command, "commands", {}).values()
        read |= {(one.envvar, one.opts[0]) for one in command.params if one.envvar}
    assert set(re.findall(r"^\| `(\w+)` \| `([-\w]+)` \|", section, re.MULTILINE)) == read


def test_every_check_of_the_doctor_is_documented_and_no_other() -> None:
    rows = [row for row in rows_of("operations.md") if len(row) == 4 and row[0].startswith("`")]
    assert {row[0].strip("`") for row in rows} == set(Check)


def test_every_command_in_a_block_of_code_is_one_that_lippmann_has() -> None:
    commands = set(typer.main.get_group(app).commands)
    for page in PAGES:
        for block in re.findall(r"```[a-z]*\n(.*?)```", page.read_text(), re.DOTALL):
            for word in re.findall(r"^\s*(?:\$ )?lippmann ([a-z][a-z-]*)", block, re.MULTILINE):
                assert word in commands, f"{page.name}: lippmann {word}"


def test_every_option_of_a_command_in_the_docs_is_one_that_it_has() -> None:
    for page in PAGES:
        for line in re.findall(
            r"(?:^|`)\s*(lippmann [a-z][^`\n]*)", page.read_text().replace("\\\n", " "), re.MULTILINE
        ):
            command, words = typer.main.get_group(app), line.partition("#")[0].split()[1:]
            while words and (inner := getattr(command, "commands", {}).get(words[0])) is not None:
                command, words = inner, words[1:]
            known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)}
            given = {word.partition("=")[0] for word in words if re.match(r"--\w", word)}
            assert given <= known | {"--help"}, f"{page.name}: {line}"


def test_every_make_target_in_the_docs_is_in_the_makefile() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        assert set(re.findall(r"`make ([a-z-]+)`", page.read_text())) <= targets, page.name
