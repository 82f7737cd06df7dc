"""The documentation as a folder of HTML files, which a browser opens without the network."""

from __future__ import annotations

import os
import shutil
from html import escape
from pathlib import Path

from lippmann.documentation.markdown import render_page
from lippmann.documentation.pages import INDEX, Page

STYLE = Path(__file__).with_name("style.css")
_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} - Lippmann</title>
<link rel="stylesheet" href="{root}style.css">
</head>
<body>
<nav>
<p><a href="{root}README.html">Lippmann documentation</a></p>
<ul>
{headings}
</ul>
</nav>
<main>
{body}
</main>
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
        file.write_text(_html(page, names), encoding="utf-8")
    shutil.copyfile(STYLE, folder / STYLE.name)
    pictures = shutil.ignore_patterns("*.py", "__pycache__")
    shutil.copytree(source / "images", folder / "images", ignore=pictures, dirs_exist_ok=True)


def page_file(folder: Path, page: Page) -> Path:
    """Return the HTML file of a page."""
    return folder / f"{page.name}.html"


def _html(page: Page, names: frozenset[str]) -> str:
    rendered = render_page(page.file.read_text(encoding="utf-8"), name=page.name, pages=names)
    headings = "\n".join(f'<li><a href="#{anchor}">{escape(text)}</a></li>' for anchor, text in rendered.headings)
    title = "Documentation" if page.name == INDEX else page.title
    return _PAGE.format(title=escape(title), root="../" * page.name.count("/"), headings=headings, body=rendered.body)
