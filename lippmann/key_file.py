"""Files of secrets: the keys that sign messages inside the farm and what leaves it, and passwords.

A file of keys holds one key per line, 64 hexadecimal digits, and comments after `#`. The first key signs, and every key
is accepted, so a key is replaced by a new one above it, and the old one is removed later. A change needs no restart.
"""

from __future__ import annotations

import hmac
import logging
import os
import secrets
import stat
import threading
from pathlib import Path

from lippmann.errors import BadInput

ORDER_KEY_FILE = "order.key"
"""The name of the file in the data folder, unless a setting names another file."""
LINK_KEY_FILE = "link.key"
"""The name of the file in the data folder of the keys for what leaves the farm, unless a setting names another file."""
KEY_BYTES = 32
MAX_KEYS = 16
MAX_BYTES = 16_384
FORBIDDEN_MODE = 0o027
"""The group may read a key file, as it must in a secret of Kubernetes, and nobody else may."""

log = logging.getLogger(__name__)


class KeyFile:
    """The keys in a file, read again when the file changes.

    A file that vanishes, or is changed to something invalid, leaves the keys that were read before.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._state: tuple[int, ...] | None = None
        self._keys: tuple[bytes, ...] = ()

    def keys(self) -> tuple[bytes, ...]:
        """Return the keys, the signing one first; empty if the file has never existed.

        Raises
        ------
        BadInput
            If no keys have been read before, and the file is invalid or cannot be read.
        """
        try:
            found = self.path.stat()
        except OSError as error:
            if self._keys or isinstance(error, FileNotFoundError):
                return self._keys
            raise BadInput(f"expected a key file that can be read, got {self.path}: {error.strerror}") from error
        state = (found.st_mtime_ns, found.st_ino, found.st_size, found.st_mode)
        with self._lock:
            if state != self._state:
                self._read()
                self._state = state
            return self._keys

    def ensure(self) -> None:
        """Write a file with a new key, which only this user may read, unless the file exists."""
        if self.path.exists():
            self.keys()
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self.path.with_name(f".{self.path.name}.{secrets.token_hex(8)}")
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        try:
            with os.fdopen(descriptor, "w", encoding="ascii") as file:
                file.write(secrets.token_hex(KEY_BYTES) + "\n")
                file.flush()
                os.fsync(file.fileno())
            # A link never replaces the file of another process that starts at the same time.
            self.path.hardlink_to(temporary)
        except FileExistsError:
            pass
        finally:
            temporary.unlink(missing_ok=True)

    def _read(self) -> None:
        try:
            self._keys = read_keys(self.path)
        except BadInput as error:
            if not self._keys:
                raise
            log.warning("the keys that were read before are kept: %s", error.message)


def derived_key(key: bytes, purpose: str) -> bytes:
    """Return the key for one purpose, 32 bytes. It tells nothing about `key` and the keys for other purposes.

    >>> derived_key(bytes(32), "a") == derived_key(bytes(32), "b")
    False
    """
    return hmac.digest(key, f"lippmann {purpose}".encode(), "sha256")


def read_secret(path: Path) -> str:
    """Return the secret in a file, such as a password, without the line break at its end.

    Raises
    ------
    BadInput
        If others may read the file, or it is empty or cannot be read.
    """
    secret = private_bytes(path).decode("utf-8", "replace").strip()
    if not secret:
        raise BadInput(f"expected a secret in {path}, got an empty file")
    return secret


def read_keys(path: Path) -> tuple[bytes, ...]:
    """Return the keys in a file, in its order.

    Raises
    ------
    BadInput
        If the file holds something else, others may read it, or it cannot be read.
    """
    data = private_bytes(path)
    lines = [line.split(b"#")[0].strip() for line in data.splitlines()]
    texts = [line for line in lines if line]
    if not texts or len(texts) > MAX_KEYS or len(data) > MAX_BYTES:
        raise BadInput(f"{path}: expected 1 to {MAX_KEYS} keys, one per line, got {len(texts)}")
    try:
        keys = tuple(bytes.fromhex(text.decode("ascii")) for text in texts)
    except ValueError:
        keys = ()
    if not keys or any(len(key) != KEY_BYTES for key in keys):
        raise BadInput(f"{path}: expected keys of {2 * KEY_BYTES} hexadecimal digits, got another text")
    return keys


def private_bytes(path: Path, *, what: str = "key file", most_bytes: int = MAX_BYTES) -> bytes:
    """Return the content of a file of secrets; of a larger one, `most_bytes` and one more.

    Raises
    ------
    BadInput
        If others may read the file, or it cannot be read.
    """
    try:
        with path.open("rb") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            data = file.read(most_bytes + 1)
    except OSError as error:
        raise BadInput(f"expected a {what} that can be read, got {path}: {error.strerror}") from error
    if mode & FORBIDDEN_MODE:
        raise BadInput(f"expected a {what} that only its user may read (chmod 600), got {path} with mode {mode:04o}")
    return data
