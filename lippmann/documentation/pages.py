"""The pages of the documentation: their names, titles and files."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput

INDEX = "README"
"""The name of the table of contents."""
_PLACES = (Path(__file__).with_name("pages"), Path(__file__).parents[2] / "docs")
"""The folder of the pages in an installed package, and in the source tree."""


@dataclass(frozen=True)
class Page:
    """One page."""

    name: str
    """The name without the ending, relative to the folder, such as `printing` or `decisions/0003-no-row-correction`."""
    title: str
    file: Path


def docs_folder() -> Path:
    """Return the folder of the pages.

    Raises
    ------
    BadInput
        If the package was installed without them.
    """
    for place in _PLACES:
        if (place / f"{INDEX}.md").is_file():
            return place
    raise BadInput(f"expected the documentation in {_PLACES[0]}, got no such folder; install Lippmann from its wheel")


def list_pages(folder: Path) -> tuple[Page, ...]:
    """Return all pages of a folder in the order of their names, the table of contents first."""
    names = sorted(file.relative_to(folder).with_suffix("").as_posix() for file in folder.rglob("*.md"))
    names.sort(key=lambda name: (name != INDEX, "/" in name))
    return tuple(Page(name, _title(folder / f"{name}.md"), folder / f"{name}.md") for name in names)


def find_page(pages: tuple[Page, ...], name: str) -> Page:
    """Return the page of a name, with or without its ending.

    Raises
    ------
    BadInput
        If there is no such page, with the names that are similar.
    """
    wanted = name.removeprefix("docs/").removesuffix(".md").removesuffix(".html")
    for page in pages:
        if page.name.lower() == wanted.lower():
            return page
    names = [page.name for page in pages]
    near = difflib.get_close_matches(wanted.lower(), names, cutoff=0.5) or [one for one in names if wanted in one][:3]
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    raise BadInput(f"expected the name of a page, as `lippmann docs --list` shows it, got {name!r}{hint}")


def _title(file: Path) -> str:
    with file.open(encoding="utf-8") as lines:
        return next(lines).removeprefix("# ").replace("`", "").strip()
