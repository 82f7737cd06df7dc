"""A stand-in for the program in the sandbox: it behaves as the file `behaviour` beside it says, without Mitsuba."""

from __future__ import annotations

import json
import os
import signal
import struct
import sys
import time
from pathlib import Path


def say(**message: object) -> None:
    """Print a message."""
    print(json.dumps(message), flush=True)


def answer(number: int, name: str, notes: list[str], **more: object) -> None:
    """Answer with a file."""
    files = {
        "radiance": name,
        **{kind: f"{number}-{kind}.f32" for kind in ("normal", "albedo", "object", "motion") if more},
    }
    say(number=number, files=files, load_s=0, trace_s=0, trace_cpu_s=0, notes=notes, **more)


def render(request: dict[str, object], behaviour: str, served: int) -> None:
    """Do what the behaviour says with a request of two pixels."""
    number, name = int(str(request["number"])), f"{request['out']}-radiance.f32"
    light = [0.25] * 6
    found = sorted(path.name for path in Path().iterdir())
    say(progress=0.5)
    if behaviour == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if behaviour == "abort":
        print("LLVM ERROR: Cannot select: fminimum", flush=True)
        os.abort()
    if behaviour == "sleep":
        time.sleep(3600)
    if behaviour == "hog":
        kept = [bytes(1 << 20) for _ in range(100_000)]
        print(len(kept))
    if behaviour == "garbage":
        print(
            '{"number": 1, "files": {"radiance": "../../secret"}, "load_s": 0}\n{{{\n\0\xff{"progress": 7}', flush=True
        )
        answer(number + 1, name, [])
        sys.exit(3)
    if behaviour == "refuse":
        return say(number=number, error={"kind": "scene", "message": "scene.xml: no such plugin"})
    if behaviour == "folder":
        os.mkdir(name)
    elif behaviour == "link":
        try:
            os.symlink("/etc/passwd", name)
        except OSError:
            print("refused", flush=True)
    else:
        more = {"long": 1, "short": -1}.get(behaviour, 0)
        light = [float("nan")] * 3 + light[3:] if behaviour == "nan" else light
        Path(name).write_bytes(struct.pack(f"<{len(light) + more}f", *[*light, 0.0][: len(light) + more]))
    if behaviour == "leave":
        os.makedirs("left/behind")
        Path("left/behind/file").write_text("x")
        Path("other").write_text("x")
    if behaviour.startswith("channels"):
        write_channels(number, behaviour)
        return answer(number, name, [], objects=["fish", "water"])
    return answer(number, name, [f"served {served}", f"found {found}"])


def write_channels(number: int, behaviour: str) -> None:
    """Write the channels of two pixels, the second one without a surface, and what the behaviour makes wrong."""
    nan = float("nan")
    values = {"normal": [0.0, 0.6, 0.8, nan, nan, nan], "albedo": [0.0, 0.5, 1.0, nan, nan, nan], "object": [2.0, 0.0]}
    values["motion"] = [0.0, 1.0, -2.5, nan, nan, nan]
    kind, _, wrong = behaviour.removeprefix("channels ").partition(" ")
    if wrong:
        values[kind][-1] = float(wrong)
    for name, numbers in values.items():
        Path(f"{number}-{name}.f32").write_bytes(struct.pack(f"<{len(numbers)}f", *numbers))


def main() -> None:
    """Answer requests, one line each."""
    beside = Path(__file__).parent
    for served, line in enumerate(sys.stdin):
        render(json.loads(line), (beside / "behaviour").read_text(), served)


if __name__ == "__main__":
    main()
