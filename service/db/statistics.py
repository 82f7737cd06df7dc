"""The statistics by which SQLite plans its queries: those of a large farm, whatever is stored now.

ANALYZE and `PRAGMA optimize` count how many rows an index finds on average. Nearly all jobs of a farm have ended, so by
the average SQLite reads all of them to find the few that are open; and of a job with 20,000 waiting tasks it reads all
of them for each batch of events that makes some ready. So the statistics are written by hand, as the manual of SQLite
describes (https://sqlite.org/optoverview.html, section 6.1). They count what the frequent queries look for. A plan that
suits a large farm costs a small one nothing, and no plan changes while a farm grows. PostgreSQL counts each value, and
a new large job makes it count again (`Database.count_tasks`).
"""

from __future__ import annotations

from sqlalchemy import Connection, text

STATISTICS: dict[tuple[str, str], str] = {
    ("jobs", "sqlite_autoindex_jobs_1"): "10000 1",
    ("jobs", "ix_jobs_status"): "10000 50 1",
    ("jobs", "ix_jobs_background_job"): "10 5",
    ("jobs", "ix_jobs_bundle"): "10000 100",
    ("jobs", "ix_jobs_busy"): "20 5 1",
    ("jobs", "ix_jobs_listed"): "10000" + 10 * " 1",
    ("tasks", "sqlite_autoindex_tasks_1"): "1000000 100000 1",
    ("tasks", "ix_tasks_job_status"): "1000000 100000 5000 1",
    ("tasks", "ix_tasks_job_stage"): "1000000 100000 5000 2",
    ("tasks", "ix_tasks_job_needs"): "500000 50000 2",
    ("tasks", "ix_tasks_job_frame"): "1000000 100000 4",
    ("tasks", "ix_tasks_ended"): "500000 1",
    ("ended_attempts", "sqlite_autoindex_ended_attempts_1"): "10000 50 2 1",
    ("worker_faults", "sqlite_autoindex_worker_faults_1"): "1000 10 1",
    ("job_events", "ix_job_events_job"): "50000 500 1",
}
"""The rows of each index, and how many of them are equal in its first column, in its first two columns, and so on."""


def fix_statistics(connection: Connection) -> None:
    """Write the statistics into an SQLite database; connections that are opened afterwards use them."""
    connection.execute(text("ANALYZE sqlite_master"))  # makes the table of statistics
    connection.execute(text("DELETE FROM sqlite_stat1"))
    rows = [{"tbl": table, "idx": index, "stat": stat} for (table, index), stat in STATISTICS.items()]
    connection.execute(text("INSERT INTO sqlite_stat1 (tbl, idx, stat) VALUES (:tbl, :idx, :stat)"), rows)
    connection.execute(text("ANALYZE sqlite_master"))  # loads it into this connection
