"""The kinds of faults, each a function that injects it once into a farm with a job that renders.

A kind returns when the fault is over or in the past. The harness brings back what is still away. All choices come from
the random generator of the run, so that a seed repeats them; when exactly they hit the job is not repeated.

kind          what a kind is
processes     workers, POV-Ray, the service and all of them are killed, stopped and ended
mitsuba       the program of Mitsuba is killed, stands still and gets no memory
broker        the broker is away, empty, damaged, full
network       the network between a part and the broker, which a proxy makes
worker_hosts  the host of a worker fails
seven_hosts   each part has a host of its own, which fails
disk          artifacts, scratch folders, the store and the database
users         what users do
"""

from __future__ import annotations

from tests.chaos.kinds import broker, disk, mitsuba, network, processes, seven_hosts, users, worker_hosts
from tests.chaos.kinds.kind import Kind as Kind
from tests.chaos.kinds.kind import Work as Work

KINDS: dict[str, Kind] = {
    **processes.KINDS,
    **mitsuba.KINDS,
    **broker.KINDS,
    **network.KINDS,
    **worker_hosts.KINDS,
    **seven_hosts.KINDS,
    **disk.KINDS,
    **users.KINDS,
}
"""All kinds by name, in the order of the table of docs/chaos.md."""
