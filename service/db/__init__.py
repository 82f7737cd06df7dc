"""The database, which is the source of truth: engine, tables, migrations and one repository of queries per table.

engine       transactions with a single writer, on SQLite (WAL) and PostgreSQL
reserve      the room that is given up when the disk is full
tables       the tables
migrations   upgrades a database of any earlier release
statistics   the statistics by which SQLite plans its queries
jobs         queries on jobs
tasks        queries on tasks
task_state   the state of a task as plain values
task_sets    sets of tasks: read and written as plain values, by a few statements
faults       queries on the failures of workers
waiting      queries that tell why jobs and tasks wait
counters     the counters in the row of a job: tasks by status, pixels, seconds
events       queries on the events of the stream
coordinator  leader election, stream position, idle clock, stop requests
access       keys, login tokens, browser sessions, idempotency keys
"""
