"""A scene that jobs can use."""

from __future__ import annotations

from lippmann.job.animation.clock import Clock
from lippmann.job.scenes.imported_sheets import ImportedSheets
from lippmann.job.scenes.scene import Parameter
from lippmann.job.scenes.stage import Stage
from service.schemas.answer import Answer


class Scene(Answer):
    """A scene that jobs can use."""

    name: str
    title: str
    description: str
    license: str
    parameters: dict[str, Parameter]
    stage: Stage
    clock: Clock
    sheets: ImportedSheets | None
    """The imported integral images of a bundle without a scene; a job on them renders nothing."""
    digest: str
    """The SHA-256 of the bundle."""
    builtin: bool
    """True if the scene comes with Lippmann."""
    owner: str = "admin"
    """The name of the key that uploaded the scene."""
    owner_id: str = "admin"
    """The owner of the scene: only the owner and admins replace it. Scenes of earlier releases belong to `admin`."""
    poster: str | None
    """The path of the poster, a PNG."""
    notes: tuple[str, ...] = ()
    """In the answer to an upload: what the zip file has that is not in the bundle."""


class SceneList(Answer):
    """A page of scenes, sorted by name."""

    items: tuple[Scene, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""
