"""Work on rows in pieces: one piece of every job's chore a round, so that nobody waits for a long one."""

from __future__ import annotations

from service.db import job_rows
from service.db.engine import Database
from service.db.tables import Chore, Job
from service.jobs.cancel import cancel_some
from service.jobs.plan import Planner
from service.jobs.remove import remove_some
from service.jobs.retry import retry_some
from service.parts import ArtifactStore
from service.settings import Settings


class Chores:
    """Does the chores of every job."""

    def __init__(self, database: Database, store: ArtifactStore, settings: Settings) -> None:
        self._database = database
        self._store = store
        self._settings = settings
        self._planner = Planner(database, store, settings)

    def do_some(self, *, slots: int, now_s: float) -> bool:
        """Do one piece of every chore; True while there is more."""
        with self._database.reading() as session:
            chores = job_rows.chores(session)
        more = False
        for job_id, chore in chores:
            more |= self._do(job_id, chore, slots, now_s)
        return more

    def _do(self, job_id: str, chore: Chore, slots: int, now_s: float) -> bool:
        if chore is Chore.PLAN:
            return self._planner.plan_some(job_id, slots=slots, now_s=now_s)
        if chore is Chore.REMOVE:
            return remove_some(self._database, self._store, job_id)
        with self._database.writing() as session:
            row = session.get(Job, job_id)
            if row is None or row.chore is not chore:
                return True
            if chore is Chore.CANCEL:
                return cancel_some(session, row, now_s=now_s)
            return retry_some(session, row, now_s=now_s, failed_share=self._settings.failed_share)
