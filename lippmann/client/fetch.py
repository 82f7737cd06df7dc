"""Download the files of a job; files that are complete in the folder already are skipped.

    out/integral/0001.png  orthoscopic/0001.png  views/0001.png  video/views.mp4 ...

Several files are downloaded at the same time. The file `.fetched.json` in the same folder records them; see
`lippmann.client.fetch_record`. If the job has not made everything, `missing.json` says what is missing and why; see
`lippmann.client.missing`.
"""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Literal

from lippmann.client import Client
from lippmann.client.errors import Refused
from lippmann.client.fetch_record import MASTERS_ONLY, OUTPUTS, PICTURES, Fetched, FetchRecord, record_of
from lippmann.client.missing import Missing, find_missing, read_state, write_missing
from lippmann.errors import ArtifactBroken, ArtifactMissing, BadInput
from lippmann.job.animation.frames import format_frames, parse_frames
from lippmann.job.spec import JobSpec
from lippmann.plan.makers import maker_of
from lippmann.terminal.progress import ProgressLine, size_text
from service.errors import ArtifactRepairing
from service.schemas.artifact import Artifact

PARALLEL = 4
"""The number of files that are downloaded at the same time."""
_DAMAGED = frozenset({ArtifactBroken.code, ArtifactMissing.code, ArtifactRepairing.code})
"""The codes of refusals that are about one file; the others are fetched nevertheless."""


@dataclass(frozen=True)
class FetchResult:
    """The result of fetching a job."""

    folder: Path
    files: tuple[Path, ...]
    """All files of the job that are in the folder now."""
    fetched: int
    """The number of files that this call downloaded."""
    fetched_bytes: int
    missing: Missing
    """The files that could not be brought; false if there are none."""


@dataclass(frozen=True)
class _Selection:
    """The wanted files of a job."""

    kinds: Sequence[str]
    """The kinds of pictures, such as `integral`."""
    frames: Collection[int] | None
    """The frames of these pictures; None for all."""
    outputs: Collection[str] | None
    """The outputs by their file names; None for all."""
    masters: bool


class _Interrupted(Exception):
    """Another download has ended the fetch."""


def fetch_job(
    client: Client,
    job_id: str,
    folder: Path,
    *,
    frames: str | None = None,
    masters: bool = False,
    outputs: Collection[str] | None = None,
    parallel: int = PARALLEL,
    is_demo: bool = False,
) -> FetchResult:
    """Download the finished files of a job into a folder: PNG pictures or EXR masters, and all outputs.

    A file that is damaged on the service, or that is not made yet, prevents no other.

    Parameters
    ----------
    frames
        The frames of the pictures, such as `1-48:2, 60`; None for all.
    masters
        True for the EXR masters in place of PNG pictures.
    outputs
        The file names of the outputs, such as `views.mp4`; then pictures are downloaded only with `frames`. None for
        all.
    parallel
        The number of files that are downloaded at the same time.
    is_demo
        True to replace the files of an earlier demo in the folder.

    Raises
    ------
    BadInput
        If the folder holds the files of another job or cannot be written, or the job has no such frame or output.
    """
    state = read_state(client, job_id)  # before the list of files: what is made in between is not damaged
    chosen = _selected(state.job.spec, frames=frames, masters=masters, outputs=outputs)
    wanted = tuple(_wanted(client, job_id, state.job.spec, chosen))
    with record_of(
        folder, state.job.id, etags=lambda: _etags(client, job_id, state.job.spec), is_demo=is_demo
    ) as record:
        downloaded, damaged = _Downloads(client, job_id, record, masters=masters).run(wanted, parallel=parallel)
        whole = [artifact.name for artifact in wanted if artifact.name not in damaged]
        missing = find_missing(
            state,
            set(whole),
            {name: error.message for name, error in damaged.items()},
            repairing={name for name, error in damaged.items() if error.code == ArtifactRepairing.code},
            frames=chosen.frames,
            kinds=chosen.kinds,
            outputs=chosen.outputs,
        )
        write_missing(folder, missing)
    return FetchResult(
        folder,
        tuple(folder / _place(name, masters=masters) for name in whole),
        fetched=len(downloaded),
        fetched_bytes=sum(one.size for one in downloaded),
        missing=missing,
    )


def _selected(spec: JobSpec, *, frames: str | None, masters: bool, outputs: Collection[str] | None) -> _Selection:
    numbers = None if frames is None else frozenset(parse_frames(frames))
    beyond = (numbers or frozenset()) - set(spec.frame_numbers)
    if beyond:
        expected = f"frames of the job, which are {format_frames(spec.frame_numbers)}"
        raise BadInput(f"--frames: expected {expected}, got {format_frames(beyond)}")
    known = [output.file_name for output in spec.outputs]
    for name in outputs or ():
        if name not in known:
            hint = "".join(f" (did you mean {meant}?)" for meant in get_close_matches(name, known, n=1))
            listed = f"one of {', '.join(known)}" if known else "none, because the job has no outputs"
            raise BadInput(f"--outputs: expected {listed}, got {name!r}{hint}")
    kinds = (*PICTURES, *MASTERS_ONLY) if masters else PICTURES
    return _Selection(kinds if outputs is None or frames is not None else (), numbers, outputs, masters)


def _wanted(client: Client, job_id: str, spec: JobSpec, chosen: _Selection) -> Iterator[Artifact]:
    for kind in chosen.kinds:
        for artifact in client.artifacts(job_id, prefix=f"{kind}/"):
            stem = Path(artifact.name).stem
            is_wanted = chosen.frames is None or (stem.isdigit() and int(stem) in chosen.frames)
            if artifact.name.endswith(".exr") and is_wanted:
                yield artifact
    for folder in OUTPUTS:
        for artifact in client.artifacts(job_id, prefix=f"{folder}/"):
            if chosen.outputs is None or _output_of(spec, artifact.name) in chosen.outputs:
                yield artifact


def _etags(client: Client, job_id: str, spec: JobSpec) -> Mapping[str, str]:
    """Return the entity tags of all files of a job by their path in the folder, as pictures and as masters."""
    everything = _Selection((*PICTURES, *MASTERS_ONLY), frames=None, outputs=None, masters=True)
    return {
        _place(artifact.name, masters=masters).as_posix(): artifact.etag
        for artifact in _wanted(client, job_id, spec, everything)
        for masters in (False, True)
    }


def _output_of(spec: JobSpec, name: str) -> str | None:
    maker = maker_of(spec, name)
    return None if maker is None else maker.output


def _place(name: str, *, masters: bool) -> Path:
    path = Path(name)
    if not path.parts or path.is_absolute() or ".." in path.parts:
        raise BadInput(f"expected files below the job, got {name!r} from the service")
    as_picture = path.suffix == ".exr" and path.parts[0] in PICTURES and not masters
    return path.with_suffix(".png") if as_picture else path


class _Downloads:
    """The downloads of one fetch, several at the same time."""

    def __init__(self, client: Client, job_id: str, record: FetchRecord, *, masters: bool) -> None:
        self._client = client
        self._job_id = job_id
        self._record = record
        self._masters = masters
        self._is_over = threading.Event()
        self._has_waited = threading.Event()
        """Set once a file was waited for in vain that the farm makes again: the others then wait no longer."""

    def run(self, wanted: Sequence[Artifact], *, parallel: int) -> tuple[list[Fetched], Mapping[str, Refused]]:
        """Download what is not complete; return that, and the damaged artifacts with the refusals of the service."""
        known, folder = self._record.known, self._record.folder
        places = {artifact.name: _place(artifact.name, masters=self._masters) for artifact in wanted}
        todo = [one for one in wanted if not _is_complete(folder, known.get(places[one.name].as_posix()), one)]
        done: list[Fetched] = []
        damaged: dict[str, Refused] = {}
        with ThreadPoolExecutor(parallel) as pool, ProgressLine(f"fetch {self._job_id}") as line:
            running = {pool.submit(self._download, one, places[one.name]): one for one in todo}
            try:
                for future in as_completed(running):
                    try:
                        done.append(future.result())
                    except Refused as error:
                        if error.code not in _DAMAGED:
                            raise
                        damaged[running[future].name] = error
                        if error.code == ArtifactRepairing.code:
                            self._has_waited.set()
                    count = len(wanted) - len(todo) + len(done) + len(damaged)
                    total = size_text(sum(one.size for one in done))
                    text = f"{count} of {len(wanted)} files, {total}"
                    line.show(count / len(wanted), text, news=count == len(wanted))
            except BaseException:
                self._is_over.set()
                pool.shutdown(cancel_futures=True)
                raise
        return done, damaged

    def _download(self, artifact: Artifact, path: Path) -> Fetched:
        made: Literal["png"] | None = "png" if path.suffix != Path(artifact.name).suffix else None
        target = self._record.folder / path
        try:
            download = self._client.download(
                self._job_id,
                artifact.name,
                target,
                format=made,
                on_bytes=lambda _: self._sleep(0.0),
                sleep=self._sleep,
                waits_for_repair=lambda: not self._has_waited.is_set(),
            )
        except OSError as error:
            raise BadInput(f"expected a folder to write {target}, got: {error.strerror}") from error
        fetched = Fetched(path, artifact.etag, download.size, target.stat().st_mtime_ns)
        self._record.add(path.as_posix(), fetched)
        return fetched

    def _sleep(self, pause_s: float) -> None:
        if self._is_over.wait(pause_s):
            raise _Interrupted


def _is_complete(folder: Path, known: Fetched | None, artifact: Artifact) -> bool:
    if known is None or known.etag != artifact.etag:
        return False
    try:
        return (folder / known.path).stat().st_size == known.size
    except OSError:
        return False


def fetch_text(result: FetchResult, *, most: int = 8) -> str:
    """Return the files that are in the folder now, as text, one line for each sub-folder."""
    folders: dict[Path, list[Path]] = {}
    for path in result.files:
        folders.setdefault(path.parent, []).append(path)
    lines = [_folder_line(folder, paths) for folder, paths in folders.items()]
    new = f"{result.fetched} of them new ({size_text(result.fetched_bytes)})"
    head = f"{len(result.files)} files in {result.folder}, {new}"
    return "\n".join([head, *lines[:most]])


def _folder_line(folder: Path, paths: Sequence[Path]) -> str:
    names = [path.name for path in paths]
    return f"  {folder}/  " + (" ".join(names) if len(names) <= 3 else f"{names[0]} ... {names[-1]} ({len(names)})")
