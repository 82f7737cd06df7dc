"""The documentation as a folder of HTML files, which a browser opens without the network."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection
from html import escape
from pathlib import Path

from lippmann.documentation.markdown import PICTURES, render_page
from lippmann.documentation.pages import INDEX, Page

STYLE = Path(__file__).with_name("style.css")
_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} - Lippmann</title>
<link rel="stylesheet" href="{root}style.css">
<link rel="expect" href="#page-end" blocking="render">
{icon}</head>
<body>
<nav>
{home}<p><a href="{root}README.html">Lippmann documentation</a></p>
<ul>
{headings}
</ul>
</nav>
<main>
{body}
</main>
<div id="page-end"></div>
</body>
</html>
"""


def site_folder(version: str) -> Path:
    """Return the folder in the user's cache in which the site of a version is written."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "lippmann" / f"docs-{version}"


def write_site(folder: Path, pages: tuple[Page, ...], *, source: Path) -> None:
    """Write all pages as HTML, their pictures and the style sheet.

    Parameters
    ----------
    folder
        The folder to write to; it is created.
    source
        The folder of the pages, with `images/`.
    """
    names = frozenset(page.name for page in pages)
    for page in pages:
        file = page_file(folder, page)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(page_html(page, names), encoding="utf-8")
    for name, file in site_files(source).items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, place)


def site_files(source: Path) -> dict[str, Path]:
    """Return the other files of the site, the style sheet and the pictures, by their names from the site's folder."""
    pictures = sorted(file for file in (source / "images").rglob("*") if file.suffix in PICTURES)
    return {STYLE.name: STYLE, **{file.relative_to(source).as_posix(): file for file in pictures}}


def page_file(folder: Path, page: Page) -> Path:
    """Return the HTML file of a page."""
    return folder / f"{page.name}.html"


def page_html(page: Page, names: Collection[str], *, home: str = "", icon: str = "") -> str:
    """Return a page as HTML.

    Parameters
    ----------
    names
        The names of all pages.
    home, icon
        The URLs of the dashboard and of its icon, where the dashboard serves the page.
    """
    rendered = render_page(page.file.read_text(encoding="utf-8"), name=page.name, pages=names)
    headings = "\n".join(f'<li><a href="#{anchor}">{escape(text)}</a></li>' for anchor, text in rendered.headings)
    title = "Documentation" if page.name == INDEX else page.title
    return _PAGE.format(
        title=escape(title),
        root="../" * page.name.count("/"),
        icon=f'<link rel="icon" type="image/svg+xml" href="{escape(icon)}">\n' if icon else "",
        home=f'<p><a href="{escape(home)}">← Dashboard</a></p>\n' if home else "",
        headings=headings,
        body=rendered.body,
    )
