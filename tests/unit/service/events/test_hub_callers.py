"""The event hub and its callers: whose events a client receives, and when its stream ends."""

from __future__ import annotations

import asyncio

import pytest
from sqlalchemy import update

from service.db.tables import Job
from service.events import hub as module
from tests.builders_service import Farm
from tests.unit.service.events.test_hub import Reader, Running, _revoke, _run, _stored, _until


@pytest.mark.promise("People", "A revoked key ends its event streams at once.")
def test_a_stream_ends_at_once_when_this_process_revokes_its_key(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECK_S", 3600.0)

    async def scenario(running: Running) -> None:
        stream = running.stream(0)
        reading = asyncio.create_task(anext(stream))
        await _until(lambda: running.hub._clients)
        await asyncio.to_thread(_revoke, farm, running.key_id)
        await asyncio.to_thread(running.hub.check_credentials)
        assert await reading == b": the key or the session is no longer valid\n\n"

    _run(farm, scenario, keepalive_s=3600.0)


def test_a_client_with_an_owner_receives_only_the_events_of_its_jobs(farm: Farm) -> None:
    mine, other = farm.submit(), farm.submit()
    with farm.writing() as session:
        session.execute(update(Job).where(Job.id == other).values(owner_id="somebody"))

    async def scenario(running: Running) -> None:
        stream = running.hub.stream(job_id=None, caller_id=running.key_id, position=0, owner_id="k")
        stored = await asyncio.to_thread(_stored, farm, 0, mine)
        reader = Reader(stream)
        await reader.read_until(stored[-1])  # from the database
        await running.append(other)
        pushed = await running.append(mine)
        await reader.read_until(pushed)  # from the hub
        assert reader.ids == [*stored, pushed]

    _run(farm, scenario, has_owners=True)


def test_a_client_with_an_owner_receives_the_events_of_shared_jobs_until_they_are_hidden(farm: Farm) -> None:
    job_id = farm.submit()

    def share(*, shared: bool) -> None:
        with farm.writing() as session:
            session.execute(update(Job).where(Job.id == job_id).values(owner_id="somebody", shared=shared))

    share(shared=True)

    async def scenario(running: Running) -> None:
        stream = running.hub.stream(job_id=job_id, caller_id=running.key_id, position=0, owner_id="k")
        stored = await asyncio.to_thread(_stored, farm, 0, job_id)
        reader = Reader(stream)
        await reader.read_until(stored[-1])  # from the database
        first = await running.append(job_id)
        await reader.read_until(first)  # from the hub
        await asyncio.to_thread(share, shared=False)
        await running.append(job_id)
        await _until(lambda: running.hub._position == first + 1)
        await asyncio.to_thread(share, shared=True)
        last = await running.append(job_id)
        await reader.read_until(last)
        assert reader.ids == [*stored, first, last]

    _run(farm, scenario, has_owners=True)
