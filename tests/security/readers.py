"""The readers of foreign text that are fuzzed, each with valid texts to begin from."""

from __future__ import annotations

import json
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from lippmann.errors import LippmannError
from lippmann.job.messages.events import Event, EventKind, Failure, ProbeResult
from lippmann.job.messages.seals import Refused, Seals
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import parse_spec
from lippmann.local.files.lens import parse_catalogue, parse_lens
from lippmann.optics.lens_files.glasses.search import GlassSearch
from lippmann.optics.lens_files.lens_file import check_lens_file
from lippmann.untrusted.json_text import read_json
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import scene_folders
from tests.security.mutations import mutated_bytes, mutated_value, mutated_zip
from tests.security.text_app import running_app
from worker.sandbox.bundle import check_bundle, unpack

Read = Callable[[bytes], object]
"""A reader: it returns, or raises a LippmannError; any other exception is a fault."""
Make = Callable[[Random], bytes]

JOBS: tuple[dict[str, Any], ...] = (
    {
        "scene": "fish",
        "title": "A fish",
        "parameters": {"turn_deg_per_frame": {"keyframes": [[1, 8], [4, 10]]}},
        "frames": "1-6:2, 9",
        "fps": 8,
        "stage": {"location": [0, 0, -500]},
        "clock": {"first": 0, "per_frame": 0.1, "repeat_frames": 45},
        "rig": {
            "imaging_lens": {"name": "athineos-2006", "focal_length_mm": 300},
            "f_number": 4,
            "lens_array": {"lattice": "hexagonal", "count": [20, 20], "pitch_mm": 1.0, "focal_length_mm": 3.3,
                           "offset_mm": {"keyframes": [[1, 60], [4, -10]], "interpolation": "smooth"}},
            "px_per_lens": 8,
        },
        "capture": {"method": "glass", "depth": True},
        "render": {"tiles": [2, 1], "timeout_s": 100},
        "outputs": ["views.mp4", {"kind": "stereo"}, {"kind": "view_grid"}, "depth.png"],
    },
    {
        "scene": "target-white",
        "rig": {
            "imaging_lens": {"title": "A lens", "surfaces": [
                {"radius_mm": 60, "thickness_mm": 8, "material": "BK7", "semi_aperture_mm": 15},
                {"radius_mm": -60, "thickness_mm": 0, "index": 1, "semi_aperture_mm": 15}]},
            "device": {"dpi": 600},
            "lens_array": {"count": [10, 10]},
        },
        "display": {"viewing_distance_mm": 500},
        "priority": 7,
    },
)  # fmt: skip
CSVS = (
    b"radius;thickness;material;index;v-no;sa\n60;8;BK7;;;15\n-60;;;;;15\n",
    b"# a lens\ninf;5;;1.5;60;10\n-40;3;AIR;;;10\n;0;STOP;;;5\n50;2;SF6;;;9\n-50;;;;;9\n",
)
ZMXS = (
    b"MODE SEQ\nNAME A lens\nUNIT MM\nSURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n"
    b"SURF 1\n  STOP\n  TYPE EVENASPH\n  CURV 0.0166\n  CONI -1\n  PARM 2 1e-6\n  DISZ 8\n  GLAS N-BK7 0 0\n  DIAM 15\n"
    b"SURF 2\n  TYPE STANDARD\n  CURV -0.0166\n  DISZ 50\n  GLAS ___BLANK 1 0 1.6 40\n  CLAP 0 9\n"
    b"SURF 3\n  TYPE STANDARD\n  CURV -0.01\n  DISZ 5\n  DIAM 15\nSURF 4\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n",
)
SEQS = (
    b"RDM;LEN 'VERSION'\nTITLE 'A lens'\nEPD 20\nDIM M\nWL 656.3 587.6 486.1\nREF 2\nYAN 0 3\nVUY 0 0.1\nSO 0 1e14\n"
    b"S 61.47 6 NBK7_SCHOTT\n  STO\n  CIR 12\nS -44.64 2.5 NSF5_SCHOTT\n  CCY 0; THC 0\nS -129.94 96\nSI 0 0\nGO\n",
    b"rdm n\ndim i\nfno 5\nyim 0 .1\nprv\n pwl 700 500 &\n 400\n 'own' 1.50 1.51 1.52\nend\nso 0 9.\ns 0.4 .2 'own'\n"
    b"asp\nk -.5; a 1e-3; b 0.\ns -.4 3\nthi s1 .25\ncuy s2 -.3 ! less\nsi 0 0\n",
)
AGFS = (
    b"CC own\nNM N-BK7 2 517642.251 1.5168 64.17 0 1\nED 7.1 8.3 2.51 -0.0009 0\n"
    b"CD 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653\n"
    b"TD 1.86E-06 1.31E-08 -1.37E-11 4.34E-07 6.27E-10 0.17 20\nLD 0.3 2.5\n",
    b"".join(b"NM G%d %d 0 1.6 50\nCD 1.6 0.012 0.01 0.002 0.003 0.0001\nLD 0.4 0.7\n" % (n, n) for n in range(1, 14)),
)
_IDS = {"job_id": "j", "task_id": "j-1", "attempt": "a", "worker": "w", "at_s": 1.9e9}
EVENTS = (
    Event(kind=EventKind.HEARTBEAT, progress=0.5, **_IDS),
    Event(kind=EventKind.DONE, probe=ProbeResult(start_s=1, s_per_px=1e-5, tileable=True), cpu_s=1, wall_s=2, **_IDS),
    Event(kind=EventKind.FAILED, failure=Failure(code="scene", message="a fault", permanent=True, frame=3), **_IDS),
)
SHEETS = b"""[sheets]
files = "frames/*.png"
pitch_px = 10.5
px_per_lens = 10
count = [5, 6]
lattice = "hexagonal"
"""

UNSIGNED = Seals(tuple, accept_unsigned=True)
"""Opens events without a signature, so that the decoder behind it is reached."""


def manifests() -> list[bytes]:
    """Return the manifests of the included scenes, and one of imported sheets."""
    return [*((folder / "scene.toml").read_bytes() for folder in scene_folders().values()), SHEETS]


def _read_job(data: bytes) -> object:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        return parse_spec(read_json(data, field="body")).model_dump_json()


def _read_manifest(data: bytes) -> object:
    return parse_scene(read_toml(data, field="scene.toml")).model_dump_json()


def _read_bundle(data: bytes) -> object:
    card = check_bundle(data).card
    with tempfile.TemporaryDirectory() as folder:
        unpack(data, Path(folder))
    return card.model_dump_json()


def _read_lens(suffix: str, data: bytes) -> object:
    file = parse_lens(Path(f"lens{suffix}"), data)
    check_lens_file(file)
    return file.prescription.model_dump_json()


def _read_catalogue(data: bytes) -> object:
    catalogue = parse_catalogue(Path("own.agf"), data)
    search = GlassSearch([catalogue])
    for name in list(catalogue.glasses)[:20]:
        search.find(name)
    return search.notes


def _read_event(data: bytes) -> object:
    try:
        return UNSIGNED.open_event(data).model_dump_json()
    except Refused as error:
        raise LippmannError("the event is dropped") from error


def _job_bytes(random: Random) -> bytes:
    if random.random() < 0.5:
        return mutated_bytes(random, [json.dumps(job).encode() for job in JOBS], most=2_000_000)
    return json.dumps(mutated_value(random, random.choice(JOBS))).encode()


def _event_bytes(random: Random) -> bytes:
    values = [json.loads(event.model_dump_json()) for event in EVENTS]
    if random.random() < 0.5:
        return mutated_bytes(random, [json.dumps(value).encode() for value in values], most=2_000_000)
    return json.dumps(mutated_value(random, random.choice(values))).encode()


def _bundle_bytes(random: Random) -> bytes:
    files = {
        "scene.toml": random.choice(manifests()),
        "scene.inc": b"sphere {}",
        "frames/1.png": b"a",
        "a/b/c.inc": b"",
    }
    return mutated_zip(random, files, most=1_000_000)


def _bytes_of(seeds: tuple[bytes, ...] | list[bytes], most: int) -> Make:
    return lambda random: mutated_bytes(random, seeds, most=most)


READERS: Mapping[str, tuple[Make, Read]] = {
    "job": (_job_bytes, _read_job),
    "scene.toml": (_bytes_of(manifests(), 300_000), _read_manifest),
    "bundle": (_bundle_bytes, _read_bundle),
    "lens.csv": (_bytes_of(CSVS, 1_000_000), partial(_read_lens, ".csv")),
    "lens.zmx": (_bytes_of(ZMXS, 1_000_000), partial(_read_lens, ".zmx")),
    "lens.seq": (_bytes_of(SEQS, 1_000_000), partial(_read_lens, ".seq")),
    "glasses.agf": (_bytes_of(AGFS, 1_000_000), _read_catalogue),
    "event": (_event_bytes, _read_event),
}
"""The makers of inputs and the readers, by name."""


@contextmanager
def request_reader() -> Iterator[Read]:
    """Lend a reader that sends a text as a job to the real application."""
    with tempfile.TemporaryDirectory() as folder, running_app(Path(folder)) as client:

        def send(data: bytes) -> object:
            for path in ("/api/v1/jobs", "/api/v1/design"):
                answer = client.post(path, content=data, headers={"Content-Type": "application/json"})
                if answer.status_code >= 500 or answer.status_code == 429:
                    raise AssertionError(f"{path} answered {answer.status_code}: {answer.text[:500]}")
                if len(answer.content) > 2_000_000:
                    raise AssertionError(f"{path} answered {len(answer.content)} bytes")
            raise LippmannError

        yield send


def job_bytes(random: Random) -> bytes:
    """Return a hostile job file."""
    return _job_bytes(random)
