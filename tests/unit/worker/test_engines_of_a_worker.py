"""A worker announces the engines that work where it is, and starts with either of them."""

from __future__ import annotations

import pytest

from lippmann.errors import PovrayMissing
from worker import app
from worker.engines.mitsuba.version import Found, Missing

MITSUBA = Found("3.9.1", "llvm_ad_rgb")


def versions(
    monkeypatch: pytest.MonkeyPatch, *, povray: bool, mitsuba: Found | Missing, wanted: str = "auto", **settings: object
) -> dict[str, str]:
    """Return the engines that a worker announces on a machine with some programs."""

    def povray_version(_: str) -> str:
        if not povray:
            raise PovrayMissing
        return "3.7"

    monkeypatch.setattr(app, "povray_version", povray_version)
    monkeypatch.setattr(app, "mitsuba_version", lambda: mitsuba)
    monkeypatch.setattr(app, "settings", app.settings.model_copy(update={"mitsuba": wanted, **settings}))
    return app.engine_versions()


def test_a_worker_announces_both_engines_with_their_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    found = versions(monkeypatch, povray=True, mitsuba=MITSUBA)
    assert found == {"povray": "3.7", "mitsuba": "3.9.1 llvm_ad_rgb"}


def test_a_worker_starts_with_mitsuba_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert versions(monkeypatch, povray=False, mitsuba=MITSUBA) == {"mitsuba": "3.9.1 llvm_ad_rgb"}


def test_a_worker_without_any_engine_starts_only_if_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PovrayMissing):
        versions(monkeypatch, povray=False, mitsuba=Missing("no LLVM"))
    assert versions(monkeypatch, povray=False, mitsuba=Missing("no LLVM"), needs_povray=False) == {}


def test_a_worker_that_shall_not_render_with_mitsuba_does_not_announce_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert versions(monkeypatch, povray=True, mitsuba=MITSUBA, wanted="off") == {"povray": "3.7"}
