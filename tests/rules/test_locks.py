"""The locks: what runs, what builds and what develops have the same versions, and what runs has no tool for tests."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from importlib.metadata import requires

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.repository import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
RUN_EXTRAS = re.findall(r"^RUN_EXTRAS := (.*)$", MAKEFILE, re.MULTILINE)[0].split()
WORKER_EXTRAS = re.findall(r"^WORKER_EXTRAS := (.*)$", MAKEFILE, re.MULTILINE)[0].split()
BASE = PROJECT["project"]["dependencies"]
ASKED_FOR = {
    "requirements.lock": [
        *BASE,
        *(line for lines in EXTRAS.values() for line in lines),
        *PROJECT["dependency-groups"]["build"],
    ],
    "requirements-run.lock": [*BASE, *(line for extra in RUN_EXTRAS for line in EXTRAS[extra])],
    "requirements-worker.lock": [*BASE, *(line for extra in (*RUN_EXTRAS, *WORKER_EXTRAS) for line in EXTRAS[extra])],
    "requirements-build.lock": PROJECT["dependency-groups"]["build"],
}


@dataclass(frozen=True)
class Locked:
    """A package of a lock; `here` is False for one of another system or Python."""

    name: str
    version: str
    here: bool
    hashes: frozenset[str]


def locked(lock: str) -> dict[str, Locked]:
    """Return the packages of a lock by name and version."""
    found = {}
    for entry in re.split(r"\n(?=\S)", (ROOT / lock).read_text(encoding="utf-8").strip()):
        first, *hashes = (part.strip() for part in entry.split("\\\n"))
        requirement = Requirement(first)
        (version,) = requirement.specifier
        assert version.operator == "==", first
        here = requirement.marker is None or requirement.marker.evaluate()
        name = canonicalize_name(requirement.name)
        found[f"{name} {version.version}"] = Locked(name, version.version, here, frozenset(hashes))
    return found


def needed(lines: list[str]) -> set[str]:
    """Return the packages that these requirements need on this machine, all the way down."""
    found: set[tuple[str, frozenset[str]]] = set()
    left = [(Requirement(line), "") for line in lines]
    while left:
        requirement, extra = left.pop()
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        package = canonicalize_name(requirement.name), frozenset(requirement.extras)
        if package not in found:
            found.add(package)
            more = [Requirement(line) for line in requires(package[0]) or []]
            left += [(one, own) for one in more for own in ("", *requirement.extras)]
    return {name for name, _ in found}


@pytest.mark.parametrize("lock", ASKED_FOR)
def test_a_lock_has_what_pyproject_asks_for_and_nothing_else(lock: str) -> None:
    here = {package.name for package in locked(lock).values() if package.here}
    assert here == needed(ASKED_FOR[lock])


@pytest.mark.parametrize("lock", ASKED_FOR)
def test_the_versions_of_a_lock_are_those_that_pyproject_allows(lock: str) -> None:
    versions = {package.name: package.version for package in locked(lock).values() if package.here}
    for requirement in map(Requirement, ASKED_FOR[lock]):
        assert requirement.specifier.contains(versions[canonicalize_name(requirement.name)]), requirement


@pytest.mark.parametrize("lock", ASKED_FOR)
def test_every_package_has_hashes(lock: str) -> None:
    for package in locked(lock).values():
        assert package.hashes, package.name
        assert all(re.fullmatch("--hash=sha256:[0-9a-f]{64}", one) for one in package.hashes), package.name


@pytest.mark.parametrize("lock", ["requirements-run.lock", "requirements-worker.lock", "requirements-build.lock"])
def test_the_locks_agree_on_versions_and_hashes(lock: str) -> None:
    everything = {key: package.hashes for key, package in locked("requirements.lock").items()}
    hashes = {key: package.hashes for key, package in locked(lock).items()}
    assert {key: everything.get(key) for key in hashes} == hashes


@pytest.mark.promise("Containers", "The images have what runs and no tools for tests, each package held by its hash.")
def test_the_images_have_what_runs_and_no_tools_for_tests() -> None:
    of_tests = {canonicalize_name(Requirement(line).name) for line in EXTRAS["dev"]}
    tools = of_tests - needed(ASKED_FOR["requirements-worker.lock"])
    assert {"pytest", "playwright", "schemathesis", "pip-audit", "cyclonedx-bom", "hypothesis", "mypy"} <= tools
    for image, lock in (("service", "requirements-run.lock"), ("worker", "requirements-worker.lock")):
        assert not tools & {package.name for package in locked(lock).values()}
        dockerfile = ROOT / f"deploy/images/{image}.Dockerfile"
        named = set(re.findall(r"\S*requirements\S*", dockerfile.read_text()))
        assert named == {lock, "requirements-build.lock"}, dockerfile.name
        installs = re.findall(r"^.*\bpip .*\binstall .*$", dockerfile.read_text(), re.MULTILINE)
        assert len(installs) == 3
        assert all("--require-hashes" in line or "--no-index" in line for line in installs), installs
        *_, last_stage = dockerfile.read_text().split("\nFROM ")
        assert re.search(r"pip uninstall --yes .* pip$", last_stage, re.MULTILINE)


def test_the_list_of_parts_has_every_package_of_the_images() -> None:
    (line,) = re.findall(r"-m (cyclonedx_py .*?) --output-file out/sbom\.json\n", MAKEFILE, re.DOTALL)
    # The command itself checks the file against the schema, which takes ten seconds.
    line = line.replace("\\\n", " ").replace("--validate", "--no-validate")
    words = [sys.executable, "-W", "ignore::UserWarning", "-m", *line.split()]
    ran = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    parts = json.loads(ran.stdout)
    assert (parts["bomFormat"], parts["specVersion"]) == ("CycloneDX", "1.6")
    hashes = {
        f"{part['name']} {part['version']}": {
            f"--hash=sha256:{one['content']}" for place in part["externalReferences"] for one in place["hashes"]
        }
        for part in parts["components"]
    }
    assert hashes == {key: package.hashes for key, package in locked("requirements-worker.lock").items()}


def test_the_build_group_is_what_the_build_system_asks_for() -> None:
    assert PROJECT["build-system"]["requires"] == PROJECT["dependency-groups"]["build"]
