"""The documentation as a site: every page is there, and every link and picture in it leads to something."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lippmann.documentation.markdown import render_page
from lippmann.documentation.pages import Page, docs_folder, find_page, list_pages
from lippmann.documentation.site import page_file, write_site
from lippmann.errors import BadInput
from tests.repository import DOCS

_LINK = re.compile(r'(?:href|src)="([^"]*)"')
_ANCHOR = re.compile(r'id="([^"]*)"')


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, str]:
    """The HTML of all pages by their files."""
    folder = tmp_path_factory.mktemp("site")
    pages = list_pages(DOCS)
    write_site(folder, pages, source=DOCS)
    return {page_file(folder, page): page_file(folder, page).read_text(encoding="utf-8") for page in pages}


def test_the_site_has_every_page_and_the_table_of_contents_comes_first(site: dict[Path, str]) -> None:
    assert docs_folder() == DOCS
    assert len(site) == len(list(DOCS.rglob("*.md")))
    assert next(iter(site)).name == "README.html"


def test_every_link_picture_and_anchor_of_the_site_leads_to_something_in_it(site: dict[Path, str]) -> None:
    dead = []
    for file, text in site.items():
        for target in _LINK.findall(text):
            path, _, anchor = target.partition("#")
            if path.startswith(("http://", "https://")):
                continue
            there = (file.parent / path).resolve() if path else file
            if not there.is_file() or (anchor and anchor not in _ANCHOR.findall(site[there])):
                dead.append(f"{file.name}: {target}")
    assert dead == []


def test_the_site_loads_nothing_from_elsewhere(site: dict[Path, str]) -> None:
    for text in site.values():
        assert not re.search(r'<script|<link[^>]+http|src="(?:https?:)?//', text)


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("[a](keys.md#x-y)", '<a href="keys.html#x-y">a</a>'),
        ("[a](sub/other.md)", '<a href="sub/other.html">a</a>'),
        ("[keys.md](keys.md#x) or keys.md", '<a href="keys.html#x">keys</a> or keys.md'),
        ("[a](https://example.org/b.md)", '<a href="https://example.org/b.md">a</a>'),
        ("[a](#here)", '<a href="#here">a</a>'),
        ("[a *b*](../service/main.py) [c](keys.md)", 'a <em>b</em> <a href="keys.html">c</a>'),
        ("[a](javascript:alert(1))", "[a](javascript:alert(1))"),
        ("<b onclick=x>", "&lt;b onclick=x&gt;"),
        ("![p](images/a.webp)", '<img src="images/a.webp" alt="p" />'),
    ],
)
def test_links_lead_to_html_and_markup_is_text(text: str, html: str) -> None:
    assert render_page(text, name="README", pages={"keys", "sub/other"}).body == f"<p>{html}</p>\n"


def test_links_of_a_page_in_a_folder_count_from_there() -> None:
    body = render_page("[a](../keys.md) [b](b.md)", name="sub/a", pages={"keys", "sub/b"}).body
    assert body == '<p><a href="../keys.html">a</a> <a href="b.html">b</a></p>\n'


def test_headings_have_the_anchors_of_github_and_equal_ones_are_numbered() -> None:
    rendered = render_page("# T\n## Why `it` waits?\n## Why it waits\n### Deeper", name="a", pages=())
    assert rendered.headings == (("why-it-waits", "Why it waits?"), ("why-it-waits-1", "Why it waits"))
    assert '<h3 id="deeper">' in rendered.body


def test_names_in_the_first_column_of_a_table_are_anchors_once() -> None:
    text = "# a\n| field | also |\n|---|---|\n| `rig.f_number`, `fps` | `b` |\n| `fps` | c |\n| `a b` | d |\n"
    body = render_page(text, name="a", pages=()).body
    assert re.findall(r'<code(?: id="([^"]*)")?>([^<]*)', body) == [
        ("rig.f_number", "rig.f_number"), ("fps", "fps"), ("", "b"), ("", "fps"), ("", "a b"),
    ]  # fmt: skip


def test_what_may_be_wider_than_the_screen_is_scrolled_with_the_keyboard() -> None:
    body = render_page("```\n<pre>\n```\n\n| a |\n|---|\n| b |\n", name="a", pages=()).body
    assert body.startswith('<pre tabindex="0"><code>&lt;pre&gt;')
    assert body.count('<div class="table" tabindex="0"><table>') == body.count("</table></div>") == 1


def test_a_page_is_found_by_its_name_and_a_wrong_name_gets_a_hint() -> None:
    pages = tuple(Page(name, name, Path(f"{name}.md")) for name in ("README", "printing", "own-scenes"))
    for name in ("printing", "Printing", "printing.md", "docs/printing.md", "printing.html"):
        assert find_page(pages, name).name == "printing"
    with pytest.raises(BadInput, match=r"got 'prining'; did you mean printing\?"):
        find_page(pages, "prining")
    with pytest.raises(BadInput, match=r"got 'scenes'; did you mean own-scenes\?"):
        find_page(pages, "scenes")
    with pytest.raises(BadInput, match=r"got 'xyz'$"):
        find_page(pages, "xyz")
