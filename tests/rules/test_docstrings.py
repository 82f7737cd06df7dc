"""A public function of two or more arguments describes them under Parameters, each by its name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.repository import ROOT

ROOMS = ("lippmann/lightfield",)
"""The packages that are held to the rule."""


def functions(module: Path) -> Iterator[ast.FunctionDef]:
    """Yield the public functions of a module that take two or more arguments."""
    for node in ast.parse(module.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and len(arguments(node)) >= 2:
            yield node


def arguments(function: ast.FunctionDef) -> list[str]:
    found = function.args
    return [each.arg for each in (*found.posonlyargs, *found.args, *found.kwonlyargs)]


def described(docstring: str) -> set[str]:
    """Return the names that the Parameters section of a docstring describes."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", docstring, re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^(\w[\w, ]*)(?: : .*)?\n +\S", section[1], re.MULTILINE) if section else []
    return {name.strip() for heading in headings for name in heading.split(",")}


MODULES = sorted(module for room in ROOMS for module in (ROOT / room).rglob("*.py"))


@pytest.mark.parametrize("module", MODULES, ids=lambda module: str(module.relative_to(ROOT)))
def test_a_function_describes_its_arguments(module: Path) -> None:
    for function in functions(module):
        missing = set(arguments(function)) - described(ast.get_docstring(function) or "")
        assert not missing, f"{module.relative_to(ROOT)}:{function.lineno}: {function.name} does not describe {missing}"


def test_the_rule_sees_what_is_missing() -> None:
    assert described("Do.\n\nParameters\n----------\na, b\n    Two.\n\nRaises\n------\nc\n    Never.") == {"a", "b"}
    assert described("Do it with a and b.") == set()
