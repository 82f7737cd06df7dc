"""Frames into one of the outputs that a job asks for."""

from __future__ import annotations

from lippmann.job.orders import Order
from lippmann.job.outputs.choice import output_called
from lippmann.plan import artifact_names as names
from worker.tasks.attempt import Work
from worker.tasks.outputs.footage import job_footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.registry import make_output
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace


def encode_output(place: Workplace, order: Order, watch: Watch) -> Work:
    """Make the output that an order names; what an earlier attempt has kept of it stays."""
    assert order.output is not None  # noqa: S101 - the dispatcher's promise
    sheet = place.job_sheet(order.job_id)
    with place.task_folder() as folder:
        make_output(
            Making(
                footage=job_footage(place, sheet),
                output=output_called(sheet.spec.outputs, order.output),
                scratch=folder,
                put=lambda name, path: place.store.put_file(names.job_artifact(sheet.job_id, name), path),
                is_there=lambda name: place.store.exists(names.job_artifact(sheet.job_id, name)),
                watch=watch,
            )
        )
    return Work()
