"""Columns of text, the same on a terminal and in a pipe."""

from __future__ import annotations

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return rows under a head, with each column as wide as its content.

    >>> print(table(("id", "status"), [("a1", "done")]))
    ID  STATUS
    a1  done
    """
    cells = [[name.upper() for name in head], *([cell(value) for value in row] for row in rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells
    )


def fields(pairs: Sequence[tuple[str, object]]) -> str:
    """Return names and values, one pair on each line; pairs without a value are left out.

    >>> print(fields([("id", "a1"), ("title", None), ("status", "done")]))
    id      a1
    status  done
    """
    lines = [(name, cell(value)) for name, value in pairs if value not in (None, "")]
    width = max((len(name) for name, _ in lines), default=0)
    return "\n".join(f"{name.ljust(width)}  {value}" for name, value in lines)


def cell(value: object) -> str:
    """Return the text of a cell: one line without control characters, because titles come from other users."""
    text = "-" if value is None else str(value)
    return "".join(letter if letter.isprintable() else " " for letter in text)
