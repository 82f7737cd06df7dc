"""The program `docker` of a user who follows the comments: `docker compose exec`, `run`, `cp` and `logs`."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

STATE: dict[str, Any] = json.loads(Path(os.environ["COMPOSITION"]).read_text())


def main(words: list[str]) -> None:
    match words:
        case ["compose", "exec", "-T", service, *command] | ["compose", "exec", service, *command] if command:
            container = STATE[service]
            os.execvpe("bwrap", [*container["entrance"], *command], container["env"])
        case ["compose", "run", "--rm", "--no-deps", "-T", service, *command]:
            container = STATE[service]
            for folder in container["volumes"]:
                Path(folder).mkdir(parents=True, exist_ok=True)
            os.execvpe("bwrap", [*container["entrance"], *command], container["env"])
        case ["compose", "logs", service]:
            print(Path(STATE[service]["log"]).read_text())
        case ["compose", "cp", source, target]:
            found = inside(source)
            place = Path(target) / found.name if Path(target).is_dir() else Path(target)
            (shutil.copytree if found.is_dir() else shutil.copy)(found, place)
        case _:
            sys.exit(f"docker: expected compose exec, run, logs or cp, got {words}")


def inside(name: str) -> Path:
    """Return the file of this machine that is SERVICE:PATH of a container."""
    service, _, path = name.partition(":")
    for target, source in STATE[service]["mounts"].items():
        if f"{path}/".startswith(f"{target}/"):
            return Path(source + path.removeprefix(target))
    sys.exit(f"docker: expected a file in a volume of {service}, got {path}")


if __name__ == "__main__":
    main(sys.argv[1:])
