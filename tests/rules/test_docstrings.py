"""Docstrings of the library: every argument is described, and every sentence is a whole one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.repository import ROOT

DESCRIBED = ("lippmann/lattice", "lippmann/lightfield", "lippmann/local", "lippmann/optics")
"""Packages whose public functions with two or more arguments have a Parameters section that names each of them."""

WHOLE_SENTENCES = ("lippmann", "service", "worker")
"""Packages whose docstrings are whole sentences."""

FRAGMENTS = ("Of", "From", "Where", "By", "As", "Likewise", "Whether", "How")
"""Words with which no docstring begins: what follows is a fragment, which does not stand alone in an editor."""

PHRASES = ("when not said", "is none", "that there is", "lies deep", "when nothing is said", "what is told")
"""Turns of phrase that no docstring has, because an engineer would not search for them."""

Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def modules(packages: tuple[str, ...]) -> list[Path]:
    """Return the modules of packages."""
    return sorted(path for package in packages for path in (ROOT / package).rglob("*.py"))


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield (line, text) of every docstring of a module: of modules, classes, functions and attributes."""
    for node in ast.walk(tree):
        if not isinstance(node, Documented):
            continue
        for statement in node.body:
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                text = statement.value.value
                if isinstance(text, str):
                    yield statement.lineno, text


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """Return the names of a function's arguments, without `self` and `cls`."""
    args = function.args
    named = [*args.posonlyargs, *args.args, *([args.vararg] if args.vararg else []), *args.kwonlyargs]
    named += [args.kwarg] if args.kwarg else []
    names = [one.arg for one in named]
    return names[1:] if names[:1] in (["self"], ["cls"]) else names


def described(docstring: str) -> set[str]:
    """Return the arguments that the Parameters section of a docstring names."""
    section = re.search(r"^Parameters\n-{10}\n(.*?)(?=^\w[\w ]*\n-{3,}$|\Z)", docstring, re.MULTILINE | re.DOTALL)
    lines = section.group(1).splitlines() if section else []
    return {name.strip().lstrip("*") for line in lines if re.match(r"[\w*]", line) for name in line.split(",")}


def undescribed(tree: ast.Module) -> Iterator[str]:
    """Yield the public functions and methods of a module with arguments that their docstrings do not describe.

    A method that says `see `Class.method`` does what the method of its base class says.
    """
    for parent in ast.walk(tree):
        if not isinstance(parent, ast.Module | ast.ClassDef) or getattr(parent, "name", "").startswith("_"):
            continue
        for function in parent.body:
            if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef) or function.name.startswith("_"):
                continue
            text, names = ast.get_docstring(function) or "", arguments(function)
            inherited = isinstance(parent, ast.ClassDef) and re.search(rf"see `\w+\.{function.name}`", text)
            missing = [name for name in names if name not in described(text)]
            if len(names) > 1 and missing and not inherited:
                yield f"line {function.lineno}: {function.name} does not describe {', '.join(missing)}"


@pytest.mark.parametrize("path", modules(DESCRIBED), ids=lambda path: str(path.relative_to(ROOT)))
def test_every_argument_of_a_public_function_is_described(path: Path) -> None:
    assert not list(undescribed(ast.parse(path.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("path", modules(WHOLE_SENTENCES), ids=lambda path: str(path.relative_to(ROOT)))
def test_docstrings_are_whole_sentences(path: Path) -> None:
    found = []
    for line, text in docstrings(ast.parse(path.read_text(encoding="utf-8"))):
        first = re.match(r"\W*(\w+)", text)
        if first and first.group(1) in FRAGMENTS:
            found.append(f"line {line} begins with {first.group(1)}: {text.strip()[:60]!r}")
        joined = " ".join(text.lower().split())
        found += [f"line {line} says {phrase!r}" for phrase in PHRASES if re.search(rf"\b{phrase}\b", joined)]
    assert not found


def test_the_rules_find_what_they_are_for() -> None:
    tree = ast.parse('"""Where lenses are."""\nx = 1\n"""The number; 2 when not said."""\ndef f(a, b):\n    """Do."""')
    assert [text for _, text in docstrings(tree)] == ["Where lenses are.", "The number; 2 when not said.", "Do."]
    assert list(undescribed(tree)) == ["line 4: f does not describe a, b"]
    assert described("Do.\n\nParameters\n----------\na, b\n    Numbers.\n*c\n    More.\n\nReturns\n-------\nint\n") == {
        "a",
        "b",
        "c",
    }
