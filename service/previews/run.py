"""One preview from its order to its answer."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TypeVar

import anyio

from lippmann.errors import Permanent, SceneError, SpecError
from lippmann.job.messages.events import Failure
from lippmann.job.messages.previews import PreviewAnswer, PreviewMade, PreviewOrder
from lippmann.job.messages.seals import Seals
from service.auth import Caller
from service.errors import PreviewFailed, PreviewReplaced
from service.previews.broker import PreviewBroker
from service.previews.choose import choose_worker
from service.previews.prepare import Prepared
from service.previews.series import PreviewSeries, Ticket
from service.rate_limits import RateLimit
from service.roster import RosterCache
from service.settings import Settings

WAITING = 32
"""The number of threads that talk to the broker about previews; each waits for an answer."""
WAIT_S = 0.2
"""The time after which a preview that waits is examined: it may be replaced, or its client may have gone."""
OF_THE_JOB = frozenset({SceneError.code, SpecError.code, Permanent.code, "optics", "bundle", "layout"})
"""The codes of failures that are due to the job, so that every other worker would give them too."""

T = TypeVar("T")


class Previews:
    """The previews that this process waits for."""

    def __init__(self, settings: Settings, *, seals: Seals) -> None:
        self._timeout_s = settings.preview_timeout_s
        self._broker = PreviewBroker(settings.broker, seals=seals)
        self._series = PreviewSeries(by_key=settings.previews_per_key)
        self._rate = RateLimit(settings.previews_per_minute)
        self._threads = anyio.CapacityLimiter(WAITING)

    async def check_rate(self, caller: Caller) -> None:
        """Count a preview of a key.

        Raises
        ------
        TooManyRequests
            If the key asks for too many previews a minute.
        """
        await self._rate.check(
            caller.key_id,
            f"this key asks for too many previews, expected at most {self._rate.per_minute} a minute "
            "(LIPPMANN_PREVIEWS_PER_MINUTE of the farm)",
        )

    async def run(
        self,
        caller: Caller,
        prepared: Prepared,
        *,
        stream: str,
        roster: RosterCache,
        is_gone: Callable[[], Awaitable[bool]],
    ) -> tuple[str, PreviewMade]:
        """Return the worker that rendered a preview, and its pictures.

        Parameters
        ----------
        stream
            The name that the client gives the series of the preview.
        roster
            The workers that are online.
        is_gone
            Returns whether the client does not wait any more.

        Raises
        ------
        TooManyRequests
            If the key waits for too many previews.
        PreviewUnavailable
            If no worker can render it.
        PreviewReplaced
            If a newer preview of the series was asked for, or the client has gone.
        PreviewFailed
            If the worker did not answer in time, or could not render it.
        SceneError
            If the scene is refused.
        BrokerUnavailable
            If the broker does not answer.
        """
        online = await self._in_thread(roster.latest)
        ticket = self._series.open(caller.key_id, stream)
        try:
            ticket.worker = choose_worker(online, prepared.job, busy=self._series.busy)
            order = PreviewOrder(
                id=ticket.id,
                worker=ticket.worker,
                job=prepared.job,
                frame=prepared.frame,
                timeout_s=self._timeout_s,
                store_id=prepared.store_id,
            )
            await self._in_thread(partial(self._broker.send, order, series=ticket.series))
            return ticket.worker, _made(await self._answer(ticket, is_gone))
        finally:
            self._series.close(ticket)
            with anyio.CancelScope(shield=True):
                await self._in_thread(partial(self._broker.drop, ticket.id))

    def close(self) -> None:
        """Close every connection."""
        self._broker.close()

    async def _answer(self, ticket: Ticket, is_gone: Callable[[], Awaitable[bool]]) -> PreviewAnswer:
        until_s = time.monotonic() + self._timeout_s
        take = partial(self._broker.answer, ticket.id, worker=ticket.worker, wait_s=WAIT_S)
        while time.monotonic() < until_s:
            answer = await self._in_thread(take)
            if answer is not None:
                return answer
            is_newest = partial(self._broker.is_newest, ticket.id, series=ticket.series)
            if ticket.is_replaced or await is_gone() or not await self._in_thread(is_newest):
                raise PreviewReplaced
        raise PreviewFailed(
            f"the worker {ticket.worker!r} did not answer within {self._timeout_s:g} s "
            "(LIPPMANN_PREVIEW_TIMEOUT_S of the service)"
        )

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(work, limiter=self._threads)


def _made(answer: PreviewAnswer) -> PreviewMade:
    if answer.made is None:
        raise _error(answer.failure)
    return answer.made


def _error(failure: Failure | None) -> Exception:
    """Return the error that a worker reports, as one of the request."""
    if failure is None:
        return PreviewFailed()
    if failure.code in OF_THE_JOB:
        return SceneError(failure.message)
    return PreviewFailed(f"the preview failed ({failure.code}): {failure.message}")
