"""The promises of SECURITY.md: each is a marker on the test that shows it, and the tables are written from the markers.

`python -m tests.security.promises` writes the tables again.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.repository import ROOT

PAGE = ROOT / "SECURITY.md"
BEGIN = "<!-- Written by `make promises` from the markers of the tests. -->"
END = "<!-- The end of what is written. -->"
SECTIONS = ("Before login", "People", "Between processes", "Scenes", "Containers")


@dataclass(frozen=True)
class Promise:
    """A promise, its section, and the test that shows it as `file::name`."""

    section: str
    text: str
    test: str


class UnclearPromiseError(ValueError):
    """A marker does not say which promise of which section a test shows."""


def promises_of(source: str, file: str) -> Iterator[Promise]:
    """Yield the promises of a file of tests, in its order."""
    if "mark.promise" not in source:
        return
    for node in ast.walk(ast.parse(source)):
        for marker in getattr(node, "decorator_list", []):
            if isinstance(marker, ast.Call) and ast.unparse(marker.func) == "pytest.mark.promise":
                yield _promise(marker, node, file)


def _promise(marker: ast.Call, node: ast.AST, file: str) -> Promise:
    place = f"{file}:{marker.lineno}"
    name = getattr(node, "name", "")
    if not (isinstance(node, ast.FunctionDef) and name.startswith("test_") and node.col_offset == 0):
        raise UnclearPromiseError(f"{place}: expected the marker on a test at the top of a module, got it on {name!r}")
    try:
        section, text = (ast.literal_eval(argument) for argument in marker.args)
    except ValueError as error:
        expected = 'promise("section", "sentence") with two literal texts'
        raise UnclearPromiseError(f"{place}: expected {expected}, got {ast.unparse(marker)}") from error
    if section not in SECTIONS:
        raise UnclearPromiseError(f"{place}: expected a section of {SECTIONS}, got {section!r}")
    if not text.endswith(".") or "|" in text or "\n" in text:
        raise UnclearPromiseError(f"{place}: expected one sentence that fits a table, got {text!r}")
    return Promise(section, text, f"{file}::{name}")


def all_promises() -> list[Promise]:
    """Return the promises of all tests, sorted by file."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [promise for path in files for promise in promises_of(path.read_text("utf-8"), _name(path))]


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def tables(promises: Iterable[Promise]) -> str:
    """Return a heading and a table for each section; a promise that several tests show is one row."""
    rows: dict[str, dict[str, list[str]]] = {section: {} for section in SECTIONS}
    for promise in promises:
        rows[promise.section].setdefault(promise.text, []).append(f"`{promise.test}`")
    return "\n".join(_table(section, tests) for section, tests in rows.items())


def _table(section: str, tests: dict[str, list[str]]) -> str:
    lines = [f"| {text} | {', '.join(names)} |\n" for text, names in tests.items()]
    return f"### {section}\n\n| promise | test |\n|---|---|\n{''.join(lines)}"


def with_tables(page: str, promises: Iterable[Promise]) -> str:
    """Return the page with the tables between its two marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"SECURITY.md: expected the lines {BEGIN!r} and {END!r}")
    return f"{before}{BEGIN}\n\n{tables(promises)}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8"), all_promises()), encoding="utf-8")
