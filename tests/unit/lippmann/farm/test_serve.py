"""The start of the service."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import FarmFailed
from lippmann.farm.serve import keep_admin_key
from service.settings import Settings


def test_a_database_that_is_none_is_named_in_one_line(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    (tmp_path / "lippmann.db").write_bytes(b"no database" * 1000)
    with pytest.raises(FarmFailed, match=r"^expected a database, got a file that is damaged or none: [^\n]*$"):
        keep_admin_key(settings, tmp_path / "admin.key")
    assert not (tmp_path / "admin.key").exists()
