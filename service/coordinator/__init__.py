"""The coordinator: the threads that keep jobs going. Only the coordinator of one process works at a time.

coordinator      the threads and their rounds
leader_election  which process leads
scheduler        dispatches ready tasks, best first
event_consumer   writes the events of workers to the database, a chunk of the stream at a time
event_rules      the consequences of events, on plain values: pure
batch_writer     writes the changes of a batch by a handful of statements
liveness         a clock that runs while no event is missed
loss_detector    which attempts and orders are lost: pure
loss_monitor     takes back the tasks of lost attempts and orders
retry_policy     the consequences of a failed attempt: pure
fault_monitor    pauses jobs while a full disk or another fault prevents their work
reconciler       repairs rows that events left wrong or incomplete
background_jobs  work on many rows, in chunks
artifact_repairer  verifies artifacts and takes back the tasks that made damaged ones
orphan_sweeper   deletes the artifacts of removed jobs
bundle_collector  deletes scene bundles that were replaced and that no job needs
cache_collector  removes old entries of the render cache
"""
