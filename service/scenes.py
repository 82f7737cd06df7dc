"""The scenes that jobs can use: built-in scenes and scenes of users."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches

from sqlalchemy import delete, or_, select
from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem
from lippmann.job.scenes.scene import SceneManifest
from lippmann.plan import artifact_names as names
from service.audit import record
from service.auth import Caller
from service.db import usage as usage_rows
from service.db.engine import Database, changed
from service.db.tables import ADMIN_OWNER, Scene
from service.errors import Forbidden, Invalid, NotFound, SceneBuiltin, StorageQuotaExceeded
from service.limits import MEGABYTE, Limit, Limits
from service.ports import CheckedBundle, Parts
from service.schemas import scene as schema
from service.schemas.access import AuditAction
from service.schemas.links import poster_url
from service.settings import Settings

MOST_COMPARED = 1000
"""The number of scenes with which an unknown name is compared."""
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
    database: Database, parts: Parts, caller: Caller, name: str, data: bytes, *, now_s: float, settings: Settings
) -> tuple[schema.Scene, bool]:
    """Store the scene of a user, and return it and whether it is new.

    Raises
    ------
    Invalid
        If the name is invalid.
    SceneBuiltin
        If the name belongs to a built-in scene.
    Forbidden
        If the name belongs to the scene of another owner, and the bundle is another one or hidden from the caller.
    StorageQuotaExceeded
        If the owner has too many scenes or bundles, or too large ones.
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
        if known is not None and caller.scope(sharing=settings.sharing) not in (None, known.owner_id):
            _check_owner(caller, known)
    bundle = parts.scenes.check(data)
    if known is not None and known.digest == bundle.digest:
        _store(parts, bundle.digest, data)  # An upload that failed in the middle may have left the scene without it.
        return _present(known, notes=bundle.notes), False
    limits = Limits(settings, caller.limits)
    with database.reading() as session:
        _check_bundles(session, caller.owner_id, bundle.digest, size=len(data), limits=limits)
    _store(parts, bundle.digest, data)
    with database.writing() as session:
        known = session.get(Scene, name)  # Somebody else may have taken the name since.
        if known is not None:
            _check_owner(caller, known)
        else:
            _check_count(session, caller, limits)
        _check_bundles(session, caller.owner_id, bundle.digest, size=len(data), limits=limits)
        usage_rows.add_bundle(session, caller.owner_id, bundle.digest, len(data))
        owner, owner_id = (caller.name, caller.owner_id) if known is None else (known.owner, known.owner_id)
        row = session.merge(_row(name, bundle, builtin=False, now_s=now_s, owner=owner, owner_id=owner_id))
        record(session, caller, AuditAction.UPLOAD_SCENE, name, now_s=now_s, detail=f"bundle {bundle.digest}")
        scene = _present(row, notes=bundle.notes)
    # The bundle is stored again, because an unused bundle may have been deleted before the row existed.
    _store(parts, bundle.digest, data)
    return scene, True


def remove_scene(database: Database, caller: Caller, name: str, *, now_s: float, settings: Settings) -> None:
    """Remove the scene of a user. Its bundle stays in the store until no job needs it either.

    Raises
    ------
    NotFound
        If the scene does not exist or is hidden from the caller.
    SceneBuiltin
        If the scene is built in.
    Forbidden
        If the scene belongs to another owner.
    """
    owner_id = caller.scope(sharing=settings.sharing)
    with database.reading() as session:
        find_scene(session, name, owner_id=owner_id)  # looks for similar names, and writers do not wait for that
    with database.writing() as session:
        row = session.get(Scene, name)
        if row is None or not _is_seen_by(row, owner_id):
            raise NotFound(f"there is no scene {name!r}")
        if row.builtin:
            raise SceneBuiltin(f"the scene {name!r} is built in, and only uploaded scenes are removed")
        if not caller.may_change(row.owner_id):
            raise Forbidden(f"the scene {name!r} belongs to {row.owner_id!r}, and only its owner and admins remove it")
        session.delete(row)
        record(session, caller, AuditAction.REMOVE_SCENE, name, now_s=now_s, detail=f"bundle {row.digest}")


def list_scenes(session: Session, *, after: str, limit: int, owner_id: str | None = None) -> Sequence[schema.Scene]:
    """Return the scenes after a name, sorted by name; of the uploaded ones only those of an owner if one is given."""
    query = select(Scene).where(Scene.name > after).order_by(Scene.name).limit(limit)
    if owner_id is not None:
        query = query.where(or_(Scene.builtin.is_(True), Scene.owner_id == owner_id))
    return [_present(row) for row in session.scalars(query)]


def get_scene(session: Session, name: str, *, owner_id: str | None = None) -> schema.Scene:
    """Return one scene."""
    return _present(find_scene(session, name, owner_id=owner_id))


def poster_of(session: Session, name: str, *, owner_id: str | None = None) -> tuple[bytes, str]:
    """Return the poster of a scene and the digest of its bundle."""
    row = find_scene(session, name, owner_id=owner_id)
    if row.poster is None:
        raise NotFound(f"the scene {name!r} has no poster")
    return row.poster, row.digest


def find_scene(session: Session, name: str, *, owner_id: str | None = None) -> Scene:
    """Return a scene's row.

    Raises
    ------
    NotFound
        If the scene does not exist, or if an owner is given to whom it does not belong and it is not built in.
    """
    row = session.get(Scene, name)
    if row is None or not _is_seen_by(row, owner_id):
        raise NotFound(f"there is no scene {name!r}{did_you_mean(session, name, owner_id=owner_id)}")
    return row


def _is_seen_by(row: Scene, owner_id: str | None) -> bool:
    return owner_id is None or row.builtin or row.owner_id == owner_id


def did_you_mean(session: Session, name: str, *, owner_id: str | None = None) -> str:
    """Return a question with the scene that a name may stand for; an empty text if no name is like it."""
    query = select(Scene.name).order_by(Scene.updated_s.desc()).limit(MOST_COMPARED)
    if owner_id is not None:
        query = query.where(or_(Scene.builtin.is_(True), Scene.owner_id == owner_id))
    return "".join(f" (did you mean {like}?)" for like in get_close_matches(name[:100], session.scalars(query), n=1))


def _store(parts: Parts, digest: str, data: bytes) -> None:
    name = names.bundle_name(digest)
    if not parts.store.exists(name):
        parts.store.put_bytes(name, data)


def _check_owner(caller: Caller, known: Scene) -> None:
    if not caller.may_change(known.owner_id):
        raise Forbidden(f"the scene {known.name!r} belongs to another owner; choose another name")


def _check_count(session: Session, caller: Caller, limits: Limits) -> None:
    count = usage_rows.scene_count(session, caller.owner_id) + 1
    _check(caller.owner_id, "scenes", limits["scenes"], count, f"{count} scenes", "replace one of them")


def _check_bundles(session: Session, owner_id: str, digest: str, *, size: int, limits: Limits) -> None:
    """Refuse a bundle of `size` bytes if its owner would store more than the limits allow.

    Raises
    ------
    StorageQuotaExceeded
        If the owner would have too many bundles, or too large ones. A bundle that the owner has stored counts once.
    """
    if usage_rows.has_bundle(session, owner_id, digest):
        return
    count, stored = usage_rows.bundles(session, owner_id)
    count, stored_mb = count + 1, (stored + size) / MEGABYTE
    advice = "bundles that were replaced count while jobs need them; remove jobs"
    _check(owner_id, "bundles", limits["bundles"], count, f"{count} scene bundles", advice)
    _check(owner_id, "bundles_mb", limits["bundles_mb"], stored_mb, f"{stored_mb:.15g} MB of scene bundles", advice)


def _check(owner_id: str, field: str, limit: Limit, value: float, have: str, advice: str) -> None:
    if value > limit.value:
        problem = FieldProblem(field=field, expected=str(limit), got=f"{value:.15g}")
        message = f"{owner_id!r} would have {have}, expected {limit}; {advice}"
        raise StorageQuotaExceeded(message, problems=[problem])


def _row(
    name: str,
    bundle: CheckedBundle,
    *,
    builtin: bool,
    now_s: float,
    owner: str = ADMIN_OWNER,
    owner_id: str = ADMIN_OWNER,
) -> Scene:
    return Scene(
        name=name,
        digest=bundle.digest,
        card=bundle.card.model_dump(mode="json"),
        builtin=builtin,
        owner=owner,
        owner_id=owner_id,
        poster=bundle.poster,
        updated_s=now_s,
    )


def _present(row: Scene, *, notes: tuple[str, ...] = ()) -> schema.Scene:
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
        owner=row.owner,
        owner_id=row.owner_id,
        poster=poster_url(row.name) if row.poster is not None else None,
        notes=notes,
    )
