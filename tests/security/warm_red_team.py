"""A stand-in for a warm engine that was taken over: before each answer it makes the attack that the bundle names."""

from __future__ import annotations

import contextlib
import io
import json
import struct
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))


def keeps_writing() -> None:
    """Write on after the answer."""

    def write() -> None:
        while True:
            with contextlib.suppress(OSError):
                Path("late").write_text("late")
            time.sleep(0.001)

    threading.Thread(target=write, daemon=True).start()


def main() -> None:
    """Answer requests for two pixels."""
    import red_team  # type: ignore[import-not-found] # it is copied beside this file

    attacks = {**vars(red_team), "keeps_writing": keeps_writing}
    for line in sys.stdin:
        request = json.loads(line)
        name, *arguments = json.loads(Path(__file__).with_name("behaviour").read_text())
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            attacks[name](*arguments)
        file = f"{request['out']}-radiance.f32"
        Path(file).write_bytes(struct.pack("<6f", *[0.25] * 6))
        said = {"number": request["number"], "files": {"radiance": file}, "load_s": 0, "trace_s": 0, "trace_cpu_s": 0}
        print(json.dumps(said | {"notes": [printed.getvalue()[:500]]}), flush=True)


if __name__ == "__main__":
    main()
