"""An attempt verifies what it reads, names what is damaged, and reports the digests of what it stores."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from lippmann.digest import Digest, digest_of
from lippmann.errors import ArtifactBroken, ArtifactMissing
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import read_digest
from tests.builders import local_place, order_of
from tests.builders_outputs import given_job
from tests.damaging import DAMAGES, Damage, delete
from tests.unit.worker.tasks.frames.test_assemble import job_with_tiles
from worker.tasks.attempts import artifacts as module
from worker.tasks.attempts.attempt import failure_of
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.encode import encode_output
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.local import JOB_ID


def digests(place: Workplace, *folders: str) -> dict[str, Digest]:
    """Return the digests of artifacts as the service knows them from the attempts that stored these."""
    found = [info.name for folder in folders for info in place.store.list(f"{JOB_ID}/{folder}")]
    return {name.removeprefix(f"{JOB_ID}/"): read_digest(place.store, name) for name in found}


def assembly(known: Mapping[str, Digest]) -> Order:
    return order_of(TaskKind.ASSEMBLE).model_copy(update={"digests": dict(known)})


def path_of(place: Workplace, name: str) -> Path:
    return place.settings.artifacts_dir / JOB_ID / name


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", ["tiles/0001/01-01.exr", "depth-tiles/0001/02-00.exr"])
def test_an_assembly_names_the_tile_that_is_damaged(tmp_path: Path, damage: Damage, name: str) -> None:
    place = job_with_tiles(tmp_path, "square")
    order = assembly(digests(place, "tiles", "depth-tiles"))
    damage(path_of(place, name))
    with pytest.raises(ArtifactMissing if damage is delete else ArtifactBroken) as raised:
        assemble_frame(place, order, NullMonitor())
    failure = failure_of(raised.value)
    assert (failure.artifact, failure.permanent) == (name, False)
    assert name in failure.message
    assert not place.store.exists(f"{JOB_ID}/{names.thumb_name(1)}")


def test_a_tile_without_a_digest_that_cannot_be_decoded_is_named_too(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square")
    path = path_of(place, "tiles/0001/01-00.exr")
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ArtifactBroken) as raised:
        assemble_frame(place, assembly({}), NullMonitor())
    assert failure_of(raised.value).artifact == "tiles/0001/01-00.exr"


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("output", ["orthoscopic.mp4", "view_grid.png"])
def test_an_output_names_the_master_that_is_damaged(tmp_path: Path, damage: Damage, output: str) -> None:
    job = given_job(tmp_path, frames="1-3", outputs=[output], count=(16, 16))
    known = digests(job.place, "orthoscopic")
    order = order_of(TaskKind.ENCODE, frame=None, output=output).model_copy(update={"digests": known})
    damage(path_of(job.place, "orthoscopic/0002.exr"))
    with pytest.raises(ArtifactMissing if damage is delete else ArtifactBroken) as raised:
        encode_output(job.place, order, NullMonitor())
    failure = failure_of(raised.value)
    assert (failure.artifact, failure.frame) == ("orthoscopic/0002.exr", 2)


def test_an_assembly_reports_the_digests_of_everything_that_it_stores(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square")
    result = assemble_frame(place, assembly({}), NullMonitor())
    stored = digests(place, "integral", "orthoscopic", "device", "views", "depth", "channels", "thumbs")
    assert len(stored) == 7
    assert result.digests == stored
    again = assemble_frame(place, assembly({}), NullMonitor())
    assert again.digests == stored


def test_an_assembly_whose_thumbnail_outlived_a_master_makes_the_master_again(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square")
    stored = assemble_frame(place, assembly({}), NullMonitor()).digests
    delete(path_of(place, "views/0001.exr"))
    assert assemble_frame(place, assembly({}), NullMonitor()).digests == stored
    assert digests(place, "views") == {"views/0001.exr": stored["views/0001.exr"]}


def test_an_output_reports_the_files_of_earlier_attempts_too(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=["view_grid.png"])
    order = order_of(TaskKind.ENCODE, frame=None, output="view_grid.png")
    first = encode_output(job.place, order, NullMonitor()).digests
    assert first == digests(job.place, "exports")
    assert len(first) == 3
    delete(path_of(job.place, "exports/view_grid.png.json"))
    assert encode_output(job.place, order, NullMonitor()).digests == first


def test_a_master_is_verified_once_an_attempt_however_often_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = given_job(tmp_path, frames="1")
    known = digests(job.place, "orthoscopic")
    order = order_of(TaskKind.ENCODE, frame=None).model_copy(update={"digests": known})
    read: list[Digest] = []

    def counted(chunks: Iterable[bytes]) -> Digest:
        read.append(digest_of(chunks))
        return read[-1]

    monkeypatch.setattr(module, "digest_of", counted)
    artifacts = module.TaskArtifacts(job.place.store, order, NullMonitor())
    for _ in range(3):
        with artifacts.opened("orthoscopic/0001.exr"):
            pass
    assert read == [known["orthoscopic/0001.exr"]]


def test_an_attempt_asks_whether_to_stop_while_bytes_are_moved(tmp_path: Path) -> None:
    """That is a sign of life, without which an attempt that sends or reads for an hour would be hung."""

    class Asked(NullMonitor):
        count = 0

        def should_stop(self) -> bool:
            self.count += 1
            return False

    place, monitor = local_place(tmp_path / "farm"), Asked()
    large = tmp_path / "large"
    large.write_bytes(bytes(3 * module.CHUNK_BYTES))
    order = order_of(TaskKind.ENCODE, frame=None)
    artifacts = module.TaskArtifacts(place.store, order, monitor)
    artifacts.put("a", large)
    assert monitor.count >= 3
    before, order = monitor.count, order.model_copy(update={"digests": artifacts.stored})
    with module.TaskArtifacts(place.store, order, monitor).opened("a"):
        assert monitor.count >= before + 3
    before = monitor.count
    assert module.TaskArtifacts(place.store, order, monitor).exists("a")
    assert monitor.count >= before + 3


def test_digests_travel_in_orders_and_events_and_older_messages_have_none(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square")
    known = digests(place, "tiles")
    order = assembly(known)
    assert Order.model_validate(order.model_dump(mode="json")).digests == known
    assert Order.model_validate(order.model_dump(mode="json", exclude={"digests"})).digests == {}
    old = '{"kind": "done", "job_id": "j", "task_id": "t", "attempt": "a", "worker": "w", "at_s": 1, "new": 1}'
    assert Event.model_validate_json(old).digests == {}
