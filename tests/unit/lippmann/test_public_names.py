"""`import lippmann`: its names are stable, and it loads no heavy library before a name needs one."""

from __future__ import annotations

import subprocess
import sys

import pytest

import lippmann

HEAVY = ("numpy", "scipy", "pydantic", "OpenImageIO", "av", "httpx", "typer", "sqlalchemy", "celery", "fastapi")
NAMES = ("CellLayout", "Client", "Eye", "IntegralImage", "JobSpec", "LippmannError", "design", "save_picture")


def loaded_by(code: str) -> set[str]:
    """Return the heavy libraries that a fresh interpreter has loaded after some code."""
    listed = f"{code}\nimport sys\nprint(*[name for name in {HEAVY!r} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", listed], check=True, capture_output=True, text=True)
    return set(ran.stdout.split())


def test_import_lippmann_loads_no_heavy_library() -> None:
    assert loaded_by("import lippmann; dir(lippmann)") == set()


def test_the_client_loads_no_pictures_and_the_image_no_network() -> None:
    assert not loaded_by("from lippmann import Client") & {"OpenImageIO", "av", "scipy", "celery", "sqlalchemy"}
    assert not loaded_by("from lippmann import IntegralImage") & {"httpx", "celery", "sqlalchemy", "fastapi", "typer"}


def test_the_public_names_are_these_and_each_can_be_imported() -> None:
    assert tuple(lippmann.__all__) == NAMES
    for name in NAMES:
        assert getattr(lippmann, name).__name__ == name
        assert name in dir(lippmann)


def test_design_is_the_function_whatever_else_is_imported() -> None:
    code = "import lippmann.plan.design.designer, lippmann.local.design, lippmann; assert callable(lippmann.design)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_another_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'IntegralPicture'"):
        getattr(lippmann, "IntegralPicture")  # noqa: B009 - mypy knows that there is none
