"""The documentation in a browser, without the network."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.terminal.output import Output


def docs(
    page: Annotated[
        str | None,
        typer.Argument(help="The page to open, for example `printing`. The default is the table of contents."),
    ] = None,
    list_all: Annotated[bool, typer.Option("--list", help="List the pages.")] = False,
    out: Annotated[Path | None, typer.Option(help="The folder to write to. The default is in your cache.")] = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Write the pages without opening a browser.")] = False,
    *,
    output: Output,
) -> None:
    """Open the documentation in a browser, without the network. It comes with the package."""
    from lippmann.documentation.pages import INDEX, docs_folder, find_page, list_pages
    from lippmann.documentation.site import page_file, site_folder, write_site
    from lippmann.terminal.table import table

    source = docs_folder()
    pages = list_pages(source)
    if list_all:
        rows = [(one.name, one.title) for one in pages]
        output.result([{"page": one.name, "title": one.title} for one in pages], table(("page", "title"), rows))
        return
    wanted = find_page(pages, page or INDEX)
    folder = out or site_folder(_version())
    write_site(folder, pages, source=source)
    file = page_file(folder, wanted).resolve()
    if not no_open:
        _open(file, output)
    output.result({"page": wanted.name, "title": wanted.title, "file": str(file)}, str(file))


def _version() -> str:
    from importlib.metadata import version

    return version("lippmann")


def _open(file: Path, output: Output) -> None:
    import webbrowser

    if not webbrowser.open(file.as_uri()):
        output.note("note: expected a browser, got none; open this file in one")
