"""One page of Markdown as HTML. No other module imports the Markdown library."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePosixPath

from markdown_it import MarkdownIt
from markdown_it.token import Token

PICTURES = frozenset({".png", ".webp", ".svg", ".gif"})
"""The endings of the pictures of pages."""
_NAME = re.compile(r"[A-Za-z_][\w.]*")
_SCROLLED = {
    "<pre>": '<pre tabindex="0">',
    "<table>": '<div class="table" tabindex="0"><table>',
    "</table>": "</table></div>",
}
"""Parts that may be wider than the screen are scrolled, by keys too. Texts of pages are escaped, so none has these."""


@dataclass(frozen=True)
class Rendered:
    """A page as HTML."""

    body: str
    headings: tuple[tuple[str, str], ...]
    """The anchor and the text of each heading of the second level."""


def render_page(text: str, *, name: str, pages: Collection[str]) -> Rendered:
    """Return a page of Markdown as HTML.

    Parameters
    ----------
    text
        The Markdown. HTML in it is shown as text.
    name
        The name of the page, from which its links count.
    pages
        The names of all pages; a link to anything else that is no picture and no URL becomes plain text.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = parser.parse(text)
    headings = _anchor_headings(tokens)
    _anchor_names(tokens, {anchor for anchor, _ in headings})
    folder = PurePosixPath(name).parent
    for token in tokens:
        if token.children:
            token.children = _lead_links(token.children, folder, pages)
    body: str = parser.renderer.render(tokens, parser.options, {})
    for plain, scrolled in _SCROLLED.items():
        body = body.replace(plain, scrolled)
    return Rendered(body, headings)


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading, as GitHub makes it.

    Examples
    --------
    >>> anchor_of("Links to files, 2 ways (`link`)")
    'links-to-files-2-ways-link'
    """
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _anchor_headings(tokens: list[Token]) -> tuple[tuple[str, str], ...]:
    seen, found = dict[str, int](), list[tuple[str, str]]()
    for token, inline in pairwise(tokens):
        if token.type != "heading_open":
            continue
        words = "".join(child.content for child in inline.children or ())
        anchor = anchor_of(words)
        seen[anchor] = seen.get(anchor, -1) + 1
        anchor = f"{anchor}-{seen[anchor]}" if seen[anchor] else anchor
        token.attrSet("id", anchor)
        if token.tag == "h2":
            found.append((anchor, words))
    return tuple(found)


def _anchor_names(tokens: list[Token], taken: set[str]) -> None:
    """Make an anchor of each name in code in the first column of a table: a field, an option, a setting."""
    is_first = False
    for token in tokens:
        if token.type in ("tr_open", "td_close"):
            is_first = token.type == "tr_open"
        if token.type == "inline" and is_first:
            for child in token.children or ():
                if child.type == "code_inline" and _NAME.fullmatch(child.content) and child.content not in taken:
                    taken.add(child.content)
                    child.attrSet("id", child.content)


def _lead_links(tokens: list[Token], folder: PurePosixPath, pages: Collection[str]) -> list[Token]:
    """Return inline tokens whose links lead to the HTML of the other pages, without links that lead nowhere."""
    kept, is_open = list[Token](), list[bool]()
    for token in tokens:
        if token.type == "link_open":
            target = _target(str(token.attrGet("href") or ""), folder, pages)
            is_open.append(target is not None)
            if target is None:
                continue
            token.attrSet("href", target)
        elif token.type == "link_close" and not is_open.pop():
            continue
        elif token.type == "text" and any(is_open) and re.fullmatch(r"[\w./-]+[.]md", token.content):
            # A link that names the file of a page names the page here.
            token.content = PurePosixPath(token.content).stem
        kept.append(token)
    return kept


def _target(href: str, folder: PurePosixPath, pages: Collection[str]) -> str | None:
    path, mark, anchor = href.partition("#")
    if not path or path.startswith(("http://", "https://")):
        return href
    if path.endswith("/") or not path.endswith(".md"):
        return href if PurePosixPath(path).suffix in PICTURES else None
    name = posixpath.normpath(folder / path.removesuffix(".md"))
    return f"{path.removesuffix('.md')}.html{mark}{anchor}" if name in pages else None
