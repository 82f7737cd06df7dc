"""A bucket of an S3 server, or the part of a bucket below a prefix.

An object appears as a whole or not at all, also one that is uploaded in parts. The parts of an upload that was
interrupted are invisible, and `sweep` removes them later. Objects whose names begin with a dot are no artifacts:

.store      the id of the store
.order/     two empty objects, which show whether the server lists objects in the order of their names

Clients download artifacts from the server by themselves, with URLs that are signed for them and expire.

Whoever reads an artifact as a file gets a copy of it in a folder of this machine (`worker.store.copies`).
"""

from __future__ import annotations

import builtins
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from datetime import UTC, datetime, timedelta
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

from boto3.s3.transfer import ProgressCallbackInvoker, TransferConfig, create_transfer_manager
from botocore.config import Config
from botocore.exceptions import BotoCoreError, ClientError, HTTPClientError

from lippmann.digest import Digest, digest_of
from lippmann.errors import NO_ROOM, ArtifactMissing, DiskFull, StoreUnavailable
from lippmann.plan.artifact_store import ArtifactInfo, Moved, moving, unwatched
from worker.store.copies import copy_folder, remove_left
from worker.store.names import check_name, check_prefix
from worker.store.s3_clients import S3Clients
from worker.store.s3_errors import code_of, translated

IDENTITY = ".store"
ORDER = (".order/a-b", ".order/a/b")
"""Two objects in the order of their names. A server that sorts folders before files lists them the other way round."""
CHUNK_BYTES = 1 << 18
PART_BYTES = 64 << 20
"""Files of this size and more are uploaded in parts."""
KNOWN_S = 15.0
"""The time for which the id of the store is believed without reading it again."""
BEYOND = frozenset({"InvalidRange", "416"})
"""The codes of an answer to a range that begins after the end of an object."""
DELETED_AT_ONCE = 1000
"""The limit of S3 for one request."""


class S3Store:
    """Artifacts as objects of a bucket; an `ArtifactStore`. Safe for any number of threads, and after a fork.

    Parameters
    ----------
    bucket
        The name of the bucket, which exists.
    copies
        The folder on this machine for copies of artifacts; it is made if it does not exist.
    prefix
        The names of all objects begin with it and a slash; if empty, the store is the whole bucket.
    endpoint
        The URL of the server; if empty, Amazon's.
    public_endpoint
        The URL of the server for clients of the farm; if empty, `endpoint`.
    region
        The region of the bucket.
    connect_s, read_s
        The longest times of a connection and between two packets of an answer, s.
    attempts
        The number of attempts of one request, with pauses that become longer.
    """

    def __init__(
        self, bucket: str, *, copies: Path, prefix: str = "", endpoint: str = "", public_endpoint: str = "",
        region: str = "", connect_s: float = 5.0, read_s: float = 30.0, attempts: int = 5,
    ) -> None:  # fmt: skip
        self._bucket = bucket
        self._prefix = f"{check_prefix(prefix)}/" if prefix else ""
        self._endpoint = endpoint or None
        config = Config(
            connect_timeout=connect_s, read_timeout=read_s, max_pool_connections=32,
            retries={"mode": "standard", "total_max_attempts": attempts},
            # The farm has digests of its own, and not every server understands those of Amazon.
            request_checksum_calculation="when_required", response_checksum_validation="when_required",
        )  # fmt: skip
        self._clients = S3Clients(self._endpoint, public_endpoint or self._endpoint, region or None, config)
        self._attempts = attempts
        self._copies = copies
        remove_left(copies)
        self._expected: str | None = None
        self._known_until_s = 0.0

    @property
    def place(self) -> str:
        """The bucket and its server, for messages."""
        return f"bucket {self._bucket} at {self._endpoint or 'Amazon S3'}"

    def identity(self) -> str | None:
        """Return the id of the store; None if it has none."""
        try:
            with translated("its id", self.place):
                return self._body(IDENTITY).decode("utf-8", "replace").strip() or None
        except ArtifactMissing:
            return None

    def make_identity(self) -> str:
        """Give the store an id unless it has one, and return its id; of several processes, one makes it."""
        with translated("its id", self.place):
            try:
                self._client.put_object(
                    **self._at(IDENTITY),
                    Body=f"{uuid.uuid4().hex}\n".encode(),
                    IfNoneMatch="*",
                )
            except ClientError as error:
                if code_of(error) not in ("PreconditionFailed", "ConditionalRequestConflict", "412", "409"):
                    raise
        identity = self.identity()
        if identity is None:
            raise StoreUnavailable(f"cannot give the store an id: {IDENTITY} is empty in {self.place}")
        return identity

    def expect(self, identity: str | None) -> None:
        """Answer with StoreUnavailable from now on while the store has another id or none; None expects no id."""
        if identity != self._expected:
            self._known_until_s = 0.0
        self._expected = identity

    def put_bytes(self, name: str, data: bytes) -> Digest:
        """Store data under a name, completely or not at all; it replaces an artifact of that name."""
        check_name(name)
        self._check_identity(name)
        with translated(name, self.place):
            self._client.put_object(**self._at(name), Body=data)
        return digest_of((data,))

    def put_file(self, name: str, path: Path, *, moved: Moved = unwatched) -> Digest:
        """Store a copy of a file under a name, completely or not at all; it replaces an artifact of that name."""
        check_name(name)
        self._check_identity(name)
        with path.open("rb") as source:
            digest = digest_of(moving(iter(lambda: source.read(CHUNK_BYTES), b""), moved))
            source.seek(0)
            with translated(name, self.place):
                if digest.size < PART_BYTES:
                    self._client.put_object(**self._at(name), Body=source)
                else:
                    self._upload(name, path, moved)
        return digest

    def _upload(self, name: str, path: Path, moved: Moved) -> None:
        """Store a copy of a file in parts, which are read while they are sent."""
        # Not with `upload_fileobj`, which reads up to ten parts into memory, nor with `upload_file`, which hides the
        # error of the server in one of its own.
        with create_transfer_manager(self._client, _IN_PARTS) as manager:
            told = [ProgressCallbackInvoker(lambda _: moved())]
            manager.upload(str(path), self._bucket, self._prefix + name, subscribers=told).result()

    def link(self, source: str, name: str) -> None:
        """Store an artifact under a second name: the server copies it."""
        check_name(name)
        check_name(source)
        self._check_identity(name)
        with self._reading(source):
            self._client.copy(self._at(source), self._bucket, self._prefix + name, Config=_IN_PARTS)

    def get_bytes(self, name: str) -> bytes:
        """Return an artifact."""
        check_name(name)
        with self._reading(name):
            return self._body(name)

    def exists(self, name: str) -> bool:
        """Return whether an artifact exists."""
        try:
            self._head(name)
        except ArtifactMissing:
            return False
        return True

    def size(self, name: str) -> int:
        """Return the size of an artifact, in bytes."""
        return int(self._head(name)["ContentLength"])

    def etag(self, name: str) -> str:
        """Return an artifact's strong entity tag, which the server makes of its content."""
        return _etag(self._head(name))

    def info(self, name: str) -> ArtifactInfo:
        """Return the size, the time and the entity tag of an artifact, by one request."""
        return _found(name, self._head(name))

    def download_url(self, name: str, *, valid_s: int, disposition: str, media_type: str) -> str:
        """Return a URL from which anybody downloads an artifact within a time, with these headers."""
        check_name(name)
        wanted = {"ResponseContentDisposition": disposition, "ResponseContentType": media_type}
        with translated(name, self.place):
            signer = self._clients.signing
            return str(signer.generate_presigned_url("get_object", Params=self._at(name) | wanted, ExpiresIn=valid_s))

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """Return bytes [start, stop) of an artifact in chunks, fewer where it ends earlier."""
        if not 0 <= start <= stop:
            raise ValueError(f"expected bytes [start, stop) with 0 <= start <= stop, got [{start}, {stop})")
        check_name(name)
        if start == stop:
            self._head(name)
            return iter(())
        with self._reading(name):
            try:
                answer = self._client.get_object(**self._at(name), Range=f"bytes={start}-{stop - 1}")
            except ClientError as error:
                if code_of(error) not in BEYOND:
                    raise
                return iter(())
        return self._chunks(name, start, stop, answer)

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> builtins.list[ArtifactInfo]:
        """Return the artifacts below a prefix, sorted by name: those after a name, and not more than `limit`."""
        below = check_prefix(prefix)
        self._check_identity(below or "its objects")
        with translated(below, self.place):
            return [*islice(self._infos(below, after), limit)]

    def folders(self) -> builtins.list[str]:
        """Return the first parts of all names that have several, sorted."""
        self._check_identity("its objects")
        with translated("its objects", self.place):
            return sorted(name[:-1] for name in self._level("") if name.endswith("/"))

    def delete(self, prefix: str) -> None:
        """Delete every artifact below a prefix, a thousand at once."""
        if not prefix:
            raise ValueError("expected a prefix, got the empty one, which means every artifact of every job")
        below = check_prefix(prefix)
        self._check_identity(below)
        with translated(below, self.place):
            names = (info.name for info in self._infos(below, ""))
            while some := [{"Key": self._prefix + name} for name in islice(names, DELETED_AT_ONCE)]:
                answer = self._client.delete_objects(Bucket=self._bucket, Delete={"Objects": some, "Quiet": True})
                for error in answer.get("Errors", ()):
                    raise StoreUnavailable(f"cannot delete {below} in {self.place}: the server answers {error['Code']}")

    @contextmanager
    def local_path(self, name: str, *, moved: Moved = unwatched) -> Iterator[Path]:
        """Yield the path of a copy of an artifact, which is removed afterwards."""
        check_name(name)
        with self._reading(name):
            answer = self._client.get_object(**self._at(name))
        chunks = self._chunks(name, 0, int(answer["ContentLength"]), answer)
        with ExitStack() as stack:
            try:
                folder = stack.enter_context(copy_folder(self._copies))
                path = folder / Path(name).name
                with path.open("xb") as file:
                    file.writelines(moving(chunks, moved))
            except OSError as error:
                if error.errno in NO_ROOM:
                    raise DiskFull(f"no room for a copy of {name} in {self._copies}: {error.strerror}") from error
                raise
            yield path

    def free_bytes(self) -> int | None:
        """Return None: a bucket has no limit that S3 tells."""
        return None

    def sweep(self, older_than_s: float) -> int:
        """Remove uploads that were begun more than `older_than_s` ago and never ended; return their number."""
        swept = 0
        with translated("its uploads", self.place):
            for upload in self._uploads(older_than_s):
                with suppress(ClientError):  # Another process has removed it, or the upload has ended.
                    self._client.abort_multipart_upload(
                        Bucket=self._bucket, Key=upload["Key"], UploadId=upload["UploadId"]
                    )
                    swept += 1
        return swept

    def count_partial(self, older_than_s: float) -> int:
        """Return the number of uploads that were begun more than `older_than_s` ago and never ended."""
        with translated("its uploads", self.place):
            return sum(1 for _ in self._uploads(older_than_s))

    @property
    def _client(self) -> Any:
        return self._clients.connecting

    def _at(self, name: str) -> dict[str, str]:
        return {"Bucket": self._bucket, "Key": self._prefix + name}

    def _body(self, name: str) -> bytes:
        """Return the content of an object, also if a connection breaks while it arrives."""
        answer = self._client.get_object(**self._at(name))
        return b"".join(self._chunks(name, 0, int(answer["ContentLength"]), answer))

    def _head(self, name: str) -> Any:
        check_name(name)
        with self._reading(name):
            return self._client.head_object(**self._at(name))

    @contextmanager
    def _reading(self, name: str) -> Iterator[None]:
        """Translate errors; an artifact counts as missing only if the store is there and is that of the farm."""
        try:
            with translated(name, self.place):
                yield
        except ArtifactMissing:
            self._known_until_s = 0.0
            if self._expected is None:
                with translated(name, self.place):
                    # Unlike the answer about one object, this one tells a missing bucket.
                    self._client.list_objects_v2(Bucket=self._bucket, Prefix=self._prefix + IDENTITY, MaxKeys=1)
            self._check_identity(name)
            raise

    def _check_identity(self, what: str) -> None:
        if self._expected is None or time.monotonic() < self._known_until_s:
            return
        found = self.identity()
        if found != self._expected:
            other = "has no id" if found is None else f"is another store, {found}"
            raise StoreUnavailable(f"cannot use {what} in the store: {self.place} {other}")
        self._known_until_s = time.monotonic() + KNOWN_S

    def _chunks(self, name: str, start: int, stop: int, answer: Any) -> Iterator[bytes]:
        """Yield the rest of an answer, and ask again for what is missing when a connection breaks."""
        etag, attempt = answer["ETag"], 0
        while True:
            with closing(answer["Body"]) as body:
                try:
                    while chunk := body.read(CHUNK_BYTES):
                        yield chunk
                        start, attempt = start + len(chunk), 0
                    return
                except _BROKEN as error:
                    attempt += 1
                    if attempt == self._attempts:
                        message = f"cannot reach {name} in the store: {self.place}: the connection failed"
                        raise StoreUnavailable(message) from error
            if start >= stop:
                return
            time.sleep(_pause_s(attempt))
            with translated(name, self.place):
                answer = self._client.get_object(**self._at(name), Range=f"bytes={start}-{stop - 1}", IfMatch=etag)

    def _infos(self, below: str, after: str) -> Iterator[ArtifactInfo]:
        """Yield the artifact `below`, then those in its folder, in the order of their names."""
        if below and below > after:
            with suppress(ArtifactMissing):
                yield self.info(below)
        folder = f"{below}/" if below else ""
        yield from self._flat(folder, after) if self._is_sorted else self._walk(folder, after)

    def _flat(self, folder: str, after: str) -> Iterator[ArtifactInfo]:
        start = {"StartAfter": self._prefix + after} if after else {}
        for page in self._pages(Prefix=self._prefix + folder, **start):
            for entry in page.get("Contents", ()):
                name = entry["Key"].removeprefix(self._prefix)
                # Some consoles make an empty object for a folder.
                if name and not name.startswith(".") and not name.endswith("/"):
                    yield _info(name, entry)

    def _walk(self, folder: str, after: str) -> Iterator[ArtifactInfo]:
        """Yield what `_flat` yields, one folder after the other, for servers that list in another order."""
        for name, entry in sorted(self._level(folder).items()):
            if entry is not None:
                if name > after:
                    yield _info(name, entry)
            elif name > after or after.startswith(name):
                yield from self._walk(name, after)

    def _level(self, folder: str) -> dict[str, Any]:
        """Return the objects of a folder by name, and its folders with a slash, each with None."""
        found: dict[str, Any] = {}
        for page in self._pages(Prefix=self._prefix + folder, Delimiter="/"):
            found.update((entry["Key"].removeprefix(self._prefix), entry) for entry in page.get("Contents", ()))
            found.update((entry["Prefix"].removeprefix(self._prefix), None) for entry in page.get("CommonPrefixes", ()))
        return {name: entry for name, entry in found.items() if name != folder and not name.startswith(".")}

    def _pages(self, **what: Any) -> Iterator[Any]:
        yield from self._client.get_paginator("list_objects_v2").paginate(Bucket=self._bucket, **what)

    @cached_property
    def _is_sorted(self) -> bool:
        """True if the server lists objects in the order of their names, as Amazon's does and some others do not."""
        for name in ORDER:
            with suppress(ClientError):
                self._client.put_object(**self._at(name), Body=b"")
        keys = [
            entry["Key"] for page in self._pages(Prefix=self._prefix + ".order/") for entry in page.get("Contents", ())
        ]
        return keys == [self._prefix + name for name in ORDER]

    def _uploads(self, older_than_s: float) -> Iterator[Any]:
        before = datetime.now(UTC) - timedelta(seconds=older_than_s)
        for page in self._client.get_paginator("list_multipart_uploads").paginate(
            Bucket=self._bucket, Prefix=self._prefix
        ):
            yield from (upload for upload in page.get("Uploads", ()) if upload["Initiated"] < before)


_IN_PARTS = TransferConfig(multipart_threshold=PART_BYTES, multipart_chunksize=PART_BYTES, max_concurrency=4)
_BROKEN = (BotoCoreError, HTTPClientError, OSError)


def _pause_s(attempt: int) -> float:
    return float(min(0.2 * 2**attempt, 5.0))


def _found(name: str, answer: Any) -> ArtifactInfo:
    return ArtifactInfo(name, int(answer["ContentLength"]), answer["LastModified"].timestamp(), _etag(answer))


def _info(name: str, entry: Any) -> ArtifactInfo:
    return ArtifactInfo(name, int(entry["Size"]), entry["LastModified"].timestamp(), _etag(entry))


def _etag(answer: Any) -> str:
    return str(answer["ETag"]).strip('"')
