"""The rights of the service at PostgreSQL are those that the documentation gives it, and a worker has none."""

from __future__ import annotations

import re

import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ProgrammingError

from lippmann.job.states import JobStatus
from tests.builders_service import Farm
from tests.repository import ROOT
from worker.settings import WorkerSettings

PAGE = (ROOT / "docs/operations.md").read_text(encoding="utf-8")
ROLE = "lippmann_of_a_test"
FORBIDDEN = (
    "CREATE TABLE public.x (y int)",
    "CREATE SCHEMA x",
    "CREATE DATABASE x",
    "CREATE ROLE x",
    "COPY (SELECT 1) TO PROGRAM 'true'",
    "SELECT pg_read_file('/etc/passwd')",
)


@pytest.mark.promise("Between processes", "The service works with a role at PostgreSQL that owns only its schema.")
def test_a_service_works_as_the_documented_role_which_may_do_no_more(postgresql_url: str) -> None:
    url = make_url(postgresql_url)
    (statements,) = re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)
    statements = re.sub(r"\blippmann\b", ROLE, statements).replace("DATABASE farm", f'DATABASE "{url.database}"')
    admin = create_engine(url, isolation_level="AUTOCOMMIT")
    with admin.connect() as connection:
        for statement in filter(str.strip, statements.split(";")):
            connection.execute(text(statement))
    as_role = url.set(username=ROLE, password="PASSWORD")
    farm = Farm(as_role.render_as_string(hide_password=False))
    try:
        job_id = farm.submit()
        farm.database.count_tasks()
        farm.work()
        assert farm.job(job_id).status is JobStatus.DONE
    finally:
        farm.database.dispose()
    engine = create_engine(as_role, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        for statement in FORBIDDEN:
            with pytest.raises(ProgrammingError, match="InsufficientPrivilege"):
                connection.execute(text(statement))
    engine.dispose()
    with admin.connect() as connection:
        connection.execute(text(f"DROP OWNED BY {ROLE} CASCADE"))
        connection.execute(text(f"DROP ROLE {ROLE}"))
    admin.dispose()


def test_a_worker_has_no_setting_for_a_database() -> None:
    assert not [name for name in WorkerSettings.model_fields if "database" in name]
