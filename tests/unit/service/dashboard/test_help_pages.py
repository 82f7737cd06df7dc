"""The documentation as the service shows it: every page, and where its links lead."""

from __future__ import annotations

import re
from urllib.parse import urljoin, urlsplit

from lippmann.documentation.pages import list_pages
from lippmann.job.outputs.output import KINDS
from lippmann.job.spec import JobSpec
from tests.builders_service import Client
from tests.repository import DOCS
from tests.unit.docs.test_docs import fields_of

_LINK = re.compile(r'(?:href|src)="([^"]*)"')
_ANCHOR = re.compile(r' id="([^"]*)"')


def test_every_page_is_shown_and_every_link_picture_and_anchor_leads_to_something(guest: Client) -> None:
    texts = {f"/help/{page.name}.html": guest.get(f"/help/{page.name}.html").text for page in list_pages(DOCS)}
    dead, others = [], set[str]()
    for address, text in texts.items():
        for target in _LINK.findall(text):
            there = urlsplit(urljoin(address, target))
            if there.netloc:
                continue
            if there.path not in texts:
                others.add(there.path)
            elif there.fragment and there.fragment not in _ANCHOR.findall(texts[there.path]):
                dead.append(f"{address}: {target}")
    assert dead == []
    assert [address for address in sorted(others) if guest.get(address).status_code != 200] == []
    assert any(address.endswith(".webp") for address in others)


def test_no_page_has_what_the_policy_of_pages_forbids(guest: Client) -> None:
    for page in list_pages(DOCS):
        answer = guest.get(f"/help/{page.name}.html")
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self';")
        assert not re.search(r"<script|<style|<[^>]* (?:style|on\w+)=", answer.text), page.name


def test_each_field_and_each_kind_of_output_has_the_anchor_to_which_the_form_leads(guest: Client) -> None:
    """See `static/new-job/form/documentation.js`."""
    anchors = {page: set(_ANCHOR.findall(guest.get(f"/help/{page}.html").text)) for page in ("job-file", "outputs")}
    assert fields_of(JobSpec) - anchors["job-file"] == set()
    assert set(KINDS) - anchors["outputs"] == set()


def test_the_first_page_is_the_table_of_contents(guest: Client) -> None:
    answer = guest.get("/help/")
    assert answer.url.path == "/help/README.html"
    assert '<a href="getting-started.html">' in answer.text
    assert '<a href="/">' in answer.text


def test_nothing_else_is_sent(guest: Client) -> None:
    for name in ("nothing.html", "job-file", "..%2fREADME.html", "images/make_dashboard.py", "pages.py", "%00"):
        assert guest.get(f"/help/{name}").status_code == 404, name
