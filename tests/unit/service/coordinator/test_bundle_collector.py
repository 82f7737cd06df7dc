"""A scene bundle is deleted when it was replaced, no job needs it, and this was so for long."""

from __future__ import annotations

import hashlib

import pytest
from sqlalchemy import update

from lippmann.plan import artifact_names as names
from service.coordinator.bundle_collector import UNUSED_S, BundleCollector
from service.db import usage as usage_rows
from service.db.tables import Job
from service.jobs.commands import cancel_job, remove_job
from service.scenes import upload_scene
from tests.builders_service import Farm, owner

ANN = owner("ann")
OLD, NEW = b"PK old", b"PK the new one"


@pytest.fixture
def collector(farm: Farm) -> BundleCollector:
    return BundleCollector(farm.database, farm.store)


def upload(farm: Farm, data: bytes, name: str = "mine") -> None:
    upload_scene(farm.database, farm.parts, ANN, name, data, now_s=farm.now_s, settings=farm.settings)


def stored(farm: Farm) -> set[bytes]:
    """Return the bundles in the store, and check that those of the owner are counted."""
    found = {data for name, data in farm.store.files.items() if name.startswith("scenes/")} - {b"PK ball"}
    with farm.database.reading() as session:
        assert usage_rows.bundles(session, "ann") == (len(found), sum(map(len, found)))
    return found


def after_long(farm: Farm, collector: BundleCollector) -> set[bytes]:
    """Return what is stored when the collector has run for longer than a bundle has to be unused."""
    collector.run(now_s=farm.now_s)
    farm.now_s += UNUSED_S
    collector.run(now_s=farm.now_s)
    return stored(farm)


def test_a_bundle_that_was_replaced_is_deleted_after_a_time_and_counts_no_more(
    farm: Farm, collector: BundleCollector
) -> None:
    upload(farm, OLD)
    upload(farm, NEW)
    assert collector.run(now_s=farm.now_s) == 0
    assert collector.run(now_s=farm.now_s + UNUSED_S - 1) == 0
    assert stored(farm) == {OLD, NEW}
    assert collector.run(now_s=farm.now_s + UNUSED_S) == 1
    assert stored(farm) == {NEW}
    assert farm.store.exists(names.bundle_name(hashlib.sha256(b"PK ball").hexdigest())), "the built-in scene"


def test_a_bundle_stays_while_a_job_of_any_status_has_it(farm: Farm, collector: BundleCollector) -> None:
    upload(farm, OLD)
    job_id = farm.submit(caller=ANN, scene="mine")
    upload(farm, NEW)
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    assert after_long(farm, collector) == {OLD, NEW}, "it may be retried"
    with farm.writing() as session:
        remove_job(session, job_id)
    farm.plan()
    assert after_long(farm, collector) == {NEW}


def test_a_bundle_that_is_uploaded_again_is_new(farm: Farm, collector: BundleCollector) -> None:
    upload(farm, OLD)
    upload(farm, NEW)
    collector.run(now_s=farm.now_s)
    upload(farm, OLD, name="other")
    farm.now_s += UNUSED_S
    assert collector.run(now_s=farm.now_s) == 0
    upload(farm, NEW, name="other")
    assert collector.run(now_s=farm.now_s) == 0, "the time begins again"
    assert after_long(farm, collector) == {NEW}


def test_the_bundle_of_a_job_of_an_earlier_release_is_in_its_job_file(farm: Farm, collector: BundleCollector) -> None:
    upload(farm, OLD)
    farm.submit(caller=ANN, scene="mine")
    lost = farm.submit(caller=ANN, scene="ball")
    upload(farm, NEW)
    with farm.writing() as session:
        session.execute(update(Job).values(bundle=None))
    farm.store.delete(names.job_artifact(lost, ""))
    with farm.database.reading() as session:
        assert usage_rows.unused_bundles(session) == (), "nothing is unused while a job is not known"
    assert after_long(farm, collector) == {OLD, NEW}
    assert farm.job(lost).bundle == ""
