"""Scenes are loaded in this process, with one variant of Mitsuba."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import pytest

from lippmann.errors import SceneError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest, parse_scene
from lippmann.job.spec import parse_spec
from tests.unit.worker.engines.mitsuba.inside.variant import variant_of_tests

STAGE = {"location": [0, 0, 10], "look_at": [0, 0, 0], "near_mm": 900, "far_mm": 2000}

Load = Callable[..., Any]


@pytest.fixture(scope="session", autouse=True)
def _variant() -> None:
    mi.set_variant(variant_of_tests())


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Return a function that loads a scene of files and gives the loaded scene."""
    from worker.engines.mitsuba.inside.scenes.load import load

    def loaded(files: dict[str, bytes | str], *, clock: float = 0.0, **parameters: Any) -> Any:
        for name, content in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
        table = {name: {"type": _type_of(value), "default": value} for name, value in parameters.items()}
        manifest: SceneManifest = parse_scene({"file": next(iter(files)), "stage": STAGE, "parameters": table})
        job = ResolvedJob.of("j", parse_spec({"scene": "mine"}), manifest, bundle="b")
        return load(tmp_path, job, clock)

    return loaded


@pytest.fixture
def refusal(load: Load) -> Callable[..., str]:
    """Return a function that gives the message with which a scene is refused."""

    def message(files: dict[str, bytes | str], **settings: Any) -> str:
        with pytest.raises(SceneError) as refused:
            load(files, **settings)
        return refused.value.message

    return message


def _type_of(value: object) -> str:
    return "boolean" if isinstance(value, bool) else "color" if isinstance(value, str) else "number"
