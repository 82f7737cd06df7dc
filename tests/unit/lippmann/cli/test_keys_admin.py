"""`lippmann keys admin`: the first key of a farm whose service writes none, or one in place of the last one."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from sqlalchemy.exc import ProgrammingError
from typer.testing import CliRunner

from lippmann.cli import main
from lippmann.errors import BadInput, FarmFailed
from service.auth import caller_of_key
from service.db import access as access_rows
from service.db.engine import Database, opened
from service.db.migrations import migrate
from service.schemas.access import Role


@pytest.fixture
def data_dir(tmp_path: Path) -> Path:
    database = Database(f"sqlite:///{tmp_path / 'lippmann.db'}")
    migrate(database)
    database.dispose()
    return tmp_path


def test_a_key_is_made_without_one_and_the_audit_log_names_it(data_dir: Path) -> None:
    ran = CliRunner().invoke(main.app, ["keys", "admin", "ann", "--data-dir", str(data_dir), "--json"])
    made = json.loads(ran.stdout)
    database = Database(f"sqlite:///{data_dir / 'lippmann.db'}")
    with database.reading() as session:
        caller = caller_of_key(session, made["key"], now_s=time.time())
        assert caller is not None
        assert (caller.id, caller.name, caller.role, caller.owner_id) == (made["id"], "ann", Role.ADMIN, "admin")
        (entry,) = access_rows.audit_page(session, before=None, limit=10, action=None, name=None, subject=None)
        assert (entry.name, entry.action, entry.subject) == ("lippmann keys admin", "create-key", made["id"])
    database.dispose()


def test_without_a_database_nothing_is_made(tmp_path: Path) -> None:
    ran = CliRunner().invoke(main.app, ["keys", "admin", "--data-dir", str(tmp_path)])
    assert isinstance(ran.exception, BadInput)
    assert "expected the database of a farm" in ran.exception.message
    assert list(tmp_path.iterdir()) == []


def test_a_database_without_tables_is_refused_with_what_makes_them(tmp_path: Path) -> None:
    (tmp_path / "lippmann.db").touch()
    ran = CliRunner().invoke(main.app, ["keys", "admin", "--data-dir", str(tmp_path)])
    assert isinstance(ran.exception, FarmFailed)
    assert "which `lippmann migrate` makes, got: no such table" in ran.exception.message


@pytest.mark.parametrize(("code", "is_named"), [("42P01", True), ("42501", True), ("42601", False)])
def test_what_postgresql_says_of_missing_tables_and_rights_is_named(
    data_dir: Path, code: str, *, is_named: bool
) -> None:
    class Refusal(Exception):
        sqlstate = code

    error = ProgrammingError("", {}, Refusal("refused"))
    with pytest.raises(FarmFailed if is_named else ProgrammingError), opened(f"sqlite:///{data_dir}/lippmann.db"):
        raise error


@pytest.mark.parametrize("name", ["", "two\nlines", 65 * "a"])
def test_a_name_that_the_api_would_refuse_is_refused(data_dir: Path, name: str) -> None:
    ran = CliRunner().invoke(main.app, ["keys", "admin", name, "--data-dir", str(data_dir)])
    assert isinstance(ran.exception, BadInput)
    assert ran.exception.message.startswith("NAME: expected 1 to 64 characters in one line, got ")
