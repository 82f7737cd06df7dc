"""The worker that renders a preview: the same one for the same scene of the same owner, where the scene is loaded."""

from __future__ import annotations

import hashlib
from collections.abc import Collection

from lippmann.job.messages.events import Presence
from lippmann.job.resolved import ResolvedJob
from service.errors import BrokerUnavailable, PreviewUnavailable
from service.roster import Roster


def choose_worker(roster: Roster | None, job: ResolvedJob, *, busy: Collection[str] = ()) -> str:
    """Return the name of the worker for a preview.

    Every process of the service finds the same one (rendezvous hashing, Thaler and Ravishankar 1998).

    Parameters
    ----------
    roster
        The workers that are online; None if the broker does not answer.
    job
        The job of the preview.
    busy
        The workers that render another preview; they are avoided if others can do it.

    Raises
    ------
    BrokerUnavailable
        If it is not known which workers are online.
    PreviewUnavailable
        If no worker can render it now. The error says what is missing.
    """
    if roster is None:
        raise BrokerUnavailable("the broker does not answer, so it is not known which workers are online")
    if not roster.present:
        raise PreviewUnavailable("no worker is online, and previews are rendered by workers")
    fitting = roster.fitting(job.requirement.text)
    if not fitting.present:
        raise PreviewUnavailable(f"no worker that is online has {_lacking(roster.present, job)}, which the job needs")
    offered = [worker.name for worker in fitting.able if worker.previews]
    if not offered:
        raise PreviewUnavailable("no worker that is online and could render this job takes orders of previews now")
    kept = f"{job.cache_scope}\n{job.bundle}\n"
    free = [name for name in offered if name not in busy] or offered
    return max(free, key=lambda name: hashlib.sha256((kept + name).encode()).digest())


def _lacking(workers: Collection[Presence], job: ResolvedJob) -> str:
    """Return what the worker lacks that lacks least."""
    lacking: list[tuple[str, ...]] = [worker.lacks(job.requirement) for worker in workers]
    fewest = min(lacking, key=len)
    return " and ".join(fewest)
