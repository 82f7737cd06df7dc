"""Tests have the same names in every process: pytest-xdist refuses to run what two processes collect differently."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import TypeGuard

import pytest

from tests.repository import ROOT

TEST_MODULES = sorted((ROOT / "tests").rglob("test_*.py"))


def sets_in_parametrize(tree: ast.Module) -> Iterator[int]:
    """Yield the lines of sets that give parameters their order or their names; a set of strings has no fixed order.

    A set among the values of a parameter is right as long as pytest numbers the values: without `ids`.
    """
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    for call in calls:
        if not (isinstance(call.func, ast.Attribute) and call.func.attr == "parametrize"):
            continue
        named = any(word.arg == "ids" and not isinstance(word.value, ast.List) for word in call.keywords)
        for argument in call.args[1:2]:
            yield from (node.lineno for node in (unsorted(argument) if named else [argument]) if is_set(node))


def unsorted(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of an expression, without what `sorted` puts in order and what is compared."""
    if isinstance(node, ast.Compare):
        return
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "sorted":
        return
    yield node
    for part in ast.iter_child_nodes(node):
        yield from unsorted(part)


def is_set(node: ast.AST) -> TypeGuard[ast.expr]:
    """Return whether an expression is a set whose order is not fixed."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id in {"set", "frozenset"}
    return isinstance(node, ast.Set | ast.SetComp)


@pytest.mark.parametrize("path", TEST_MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_set_gives_parameters_their_order_or_names(path: Path) -> None:
    assert not list(sets_in_parametrize(ast.parse(path.read_text())))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('p.parametrize("x", {"a", "b"})', [1]),
        ('p.parametrize("x", set(NAMES))', [1]),
        ('p.parametrize("x", [{"a", "b"}], ids=" ".join)', [1]),
        ('p.parametrize("x", [{"a", "b"}], ids=["both"])', []),
        ('p.parametrize("x", [{"a", "b"}])', []),
        ('p.parametrize("x", sorted({"a", "b"}), ids=str)', []),
        ('p.parametrize("x", [name for name in NAMES if name in {"a", "b"}], ids=str)', []),
    ],
)
def test_the_rule_finds_them(text: str, found: list[int]) -> None:
    assert list(sets_in_parametrize(ast.parse(text))) == found
