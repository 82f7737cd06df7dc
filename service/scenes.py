"""The scenes that jobs can use: built-in scenes and scenes of users."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from lippmann.job.scene import SceneManifest
from lippmann.plan import artifact_names as names
from service.db.engine import Database, changed
from service.db.tables import Scene
from service.errors import Invalid, NotFound, SceneBuiltin
from service.ports import CheckedBundle, Parts
from service.schemas import scene as schema
from service.schemas.links import poster_url

_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,99}")


def sync_builtin(database: Database, parts: Parts, *, now_s: float) -> None:
    """Store the built-in scenes, and delete those of an earlier release that no longer exist."""
    builtin = {name: (data, parts.scenes.check(data)) for name, data in parts.scenes.builtin().items()}
    for data, bundle in builtin.values():
        _store(parts, bundle.digest, data)
    with database.writing() as session:
        changed(session, delete(Scene).where(Scene.builtin.is_(True), Scene.name.not_in(list(builtin))))
        for name, (_, bundle) in builtin.items():
            session.merge(_row(name, bundle, builtin=True, now_s=now_s))


def upload_scene(
    database: Database, parts: Parts, name: str, data: bytes, *, now_s: float
) -> tuple[schema.Scene, bool]:
    """Store the scene of a user, and return it and whether it is new.

    Raises
    ------
    Invalid
        If the name is invalid.
    SceneBuiltin
        If the name belongs to a built-in scene.
    BundleError
        If the bundle is invalid.
    """
    if not _NAME.fullmatch(name):
        problem = FieldProblem(field="name", expected="lower-case letters, digits and dashes", got=repr(name))
        raise Invalid(str(problem), problems=[problem])
    with database.reading() as session:
        known = session.get(Scene, name)
        if known is not None and known.builtin:
            raise SceneBuiltin(f"the scene {name!r} is built in; choose another name")
    bundle = parts.scenes.check(data)
    if known is not None and known.digest == bundle.digest:
        return _present(known), False
    _store(parts, bundle.digest, data)
    with database.writing() as session:
        row = session.merge(_row(name, bundle, builtin=False, now_s=now_s))
        scene = _present(row)
    # The bundle is stored again, because an unused bundle may have been deleted before the row existed.
    _store(parts, bundle.digest, data)
    return scene, True


def list_scenes(session: Session, *, after: str, limit: int) -> Sequence[schema.Scene]:
    """Return the scenes after a name, sorted by name."""
    query = select(Scene).where(Scene.name > after).order_by(Scene.name).limit(limit)
    return [_present(row) for row in session.scalars(query)]


def get_scene(session: Session, name: str) -> schema.Scene:
    """Return one scene."""
    return _present(find_scene(session, name))


def poster_of(session: Session, name: str) -> tuple[bytes, str]:
    """Return the poster of a scene and the digest of its bundle."""
    row = find_scene(session, name)
    if row.poster is None:
        raise NotFound(f"the scene {name!r} has no poster")
    return row.poster, row.digest


def find_scene(session: Session, name: str) -> Scene:
    """Return a scene's row.

    Raises
    ------
    NotFound
        If the scene does not exist.
    """
    row = session.get(Scene, name)
    if row is None:
        raise NotFound(f"there is no scene {name!r}")
    return row


def _store(parts: Parts, digest: str, data: bytes) -> None:
    name = names.bundle_name(digest)
    if not parts.store.exists(name):
        parts.store.put_bytes(name, data)


def _row(name: str, bundle: CheckedBundle, *, builtin: bool, now_s: float) -> Scene:
    card = bundle.card.model_dump(mode="json")
    return Scene(name=name, digest=bundle.digest, card=card, builtin=builtin, poster=bundle.poster, updated_s=now_s)


def _present(row: Scene) -> schema.Scene:
    card = SceneManifest.model_validate(row.card)
    return schema.Scene(
        name=row.name,
        title=card.title,
        description=card.description,
        license=card.license,
        parameters=card.parameters,
        stage=card.stage,
        clock=card.clock,
        sheets=card.sheets,
        digest=row.digest,
        builtin=row.builtin,
        poster=poster_url(row.name) if row.poster is not None else None,
    )
