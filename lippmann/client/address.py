"""The address of the service, and the key to it.

They come from the options `--url` and `--key`, else from the environment (`LIPPMANN_URL`, `LIPPMANN_KEY`), else from
`farm.json`. `lippmann up` keeps that file in its data folder while it runs, and only its user may read it. In a
container of the service, the key comes from the file of `LIPPMANN_KEY_FILE`, which `lippmann serve` has written.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from lippmann.errors import BadInput, NotAllowed, Unreachable
from lippmann.key_file import read_secret

FARM_FILE = "farm.json"
DATA_DIR = Path("data")
"""The data folder of the farm on this machine, unless `LIPPMANN_DATA_DIR` names another one."""


@dataclass(frozen=True)
class Address:
    """A service and a key to it."""

    url: str
    key: str


def find_address(*, url: str | None, key: str | None, data_dir: Path) -> Address:
    """Return the service that the options name, or the one-machine farm of the data folder.

    Raises
    ------
    BadInput
        If the URL is invalid, or the file of `LIPPMANN_KEY_FILE` is needed and cannot be read.
    Unreachable
        If there is neither a URL nor a farm.
    NotAllowed
        If there is a URL but no key.
    """
    key = key and key.strip()  # A file with a key ends with a line end.
    farm = None if url is not None and key is not None else read_farm_file(data_dir)
    if url is None:
        if farm is None:
            raise Unreachable(
                f"expected --url, LIPPMANN_URL or a running farm (`lippmann up`), got no {data_dir / FARM_FILE}"
            )
        return Address(url=farm.url, key=key or farm.key)
    url = url.rstrip("/").removesuffix("/api/v1").rstrip("/")
    if not url.startswith(("http://", "https://")):
        raise BadInput(f"--url: expected http:// or https://, got {url!r}")
    if key is None and farm is not None and farm.url == url:
        key = farm.key
    if key is None and (key_file := os.environ.get("LIPPMANN_KEY_FILE")):
        key = read_secret(Path(key_file))
    if key is None:
        raise NotAllowed(f"expected a key to {url} in --key, LIPPMANN_KEY or the file of LIPPMANN_KEY_FILE, got none")
    return Address(url=url, key=key)


def environment_address(*, url: str | None, key: str | None, data_dir: Path | None) -> Address:
    """Return the service that the arguments name, or the environment, or the farm of the data folder.

    An empty `key` sends no key; only the health of a farm and signed links need none.

    Raises
    ------
    BadInput, NotAllowed, Unreachable
        As in `find_address`.
    """
    url = url or os.environ.get("LIPPMANN_URL") or None
    if key is None:
        key = os.environ.get("LIPPMANN_KEY") or None
    data_dir = Path(data_dir or os.environ.get("LIPPMANN_DATA_DIR") or DATA_DIR)
    return find_address(url=url, key=key, data_dir=data_dir)


def read_farm_file(data_dir: Path) -> Address | None:
    """Return the farm that runs on a data folder, or None."""
    path = data_dir / FARM_FILE
    try:
        data = json.loads(path.read_bytes())
        return Address(url=str(data["url"]), key=str(data["key"]))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except PermissionError as error:
        raise NotAllowed(f"expected a farm file of your own, got {path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{path}: expected JSON with url and key, got {error!r}") from error


def write_farm_file(data_dir: Path, address: Address) -> None:
    """Write the address of the farm to its data folder, atomically, and readable by its user only."""
    write_private(data_dir / FARM_FILE, json.dumps(asdict(address)) + "\n")


def remove_farm_file(data_dir: Path) -> None:
    """Remove the address of the farm from its data folder."""
    (data_dir / FARM_FILE).unlink(missing_ok=True)


def write_private(path: Path, text: str) -> None:
    """Write a file atomically that only its user may read."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    try:
        with os.fdopen(descriptor, "w") as file:
            file.write(text)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
