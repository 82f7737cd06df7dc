"""A scene that jobs can ask for."""

from __future__ import annotations

from lippmann.job.imported_sheets import ForeignSheets
from lippmann.job.scene import Parameter
from lippmann.job.spec import Clock
from lippmann.job.stage import Stage
from service.schemas.answer import Answer


class Scene(Answer):
    """A scene."""

    name: str
    title: str
    description: str
    license: str
    parameters: dict[str, Parameter]
    stage: Stage
    clock: Clock
    sheets: ForeignSheets | None
    """In place of a scene, integral images that are there already: a job of them renders nothing."""
    digest: str
    """SHA-256 of the bundle."""
    builtin: bool
    poster: str | None


class SceneList(Answer):
    """Scenes by name."""

    items: tuple[Scene, ...]
    next_cursor: str | None
