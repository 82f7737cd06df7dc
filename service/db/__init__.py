"""The truth: engine, tables, migrations, named queries.

engine       one writer at a time, on SQLite (WAL) and PostgreSQL
tables       what is remembered
migrations   how a database of any age becomes today's
tally        how many tasks of a job stand where, and the guarded moves that keep it right
job_rows     named queries about jobs
task_rows    named queries about tasks
event_rows   what listeners hear
clerk_rows   leader, position in the stream, idle clock, attempts to stop
access_rows  keys, login tokens, browser sessions, idempotency keys
mend_rows    what cannot be read any more
sweep_rows   what artifacts belong to
"""
