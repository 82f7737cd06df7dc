"""The services of a composition as processes, and the shell of a user who follows the comments of its files."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.broker import free_port
from tests.composition.container import Container, work_dir_of
from tests.object_store import PORTS as STORE_PORTS
from tests.repository import ROOT

COMPOSE = str(Path(sysconfig.get_path("scripts")) / "docker-compose")
HOSTS = ("redis", "database", "store", "service")
ABSENT = {"prometheus", "grafana"}
"""Services whose programs are in no package for tests."""
SLOTS = {"LIPPMANN_SLOTS": "1"}
"""The environment that the test adds to a worker, whatever the cores of this machine."""


def composed(folder: Path = ROOT, env: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return a composition as compose understands it; COMPOSE_FILE of `env` names its files."""
    ran = subprocess.run(
        [COMPOSE, "config", "--format", "json"],
        cwd=folder, env={**os.environ, **(env or {})}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    # Compose prints a form that could be read again, with dollars doubled.
    described: dict[str, Any] = json.loads(ran.stdout.replace("$$", "$"))
    return described


def files_of(*overrides: Path) -> str:
    """Return COMPOSE_FILE for docker-compose.yml with overrides."""
    return ":".join(["docker-compose.yml", *(path.relative_to(ROOT).as_posix() for path in overrides)])


def commands_of(file: Path) -> list[str]:
    """Return the lines of a shell in the comments at the begin of a file."""
    comment = file.read_text(encoding="utf-8").partition("\n\n")[0]
    return re.findall(r"^#   (\S.*)$", comment, re.MULTILINE)


class Composition:
    """A folder with what a clone has for compose, a shell in it, and the containers that its `up` starts."""

    def __init__(self, folder: Path, *, without: Collection[str]) -> None:
        self.folder = folder
        self.absent = ABSENT | set(without)
        self.env: dict[str, str] = {}
        self.job_id = ""
        self.containers: dict[str, list[Container]] = {}
        self.stores = {name: free_port() for name in STORE_PORTS}
        self.ports = {port: str(free_port()) for port in ("6379", "5432", "8333", "8080", "443", "2020")}
        master, filer = (
            f"{self.stores[f'{one}.port']}.{self.stores[f'{one}.port.grpc']}" for one in ("master", "filer")
        )
        self.ports |= {"9333": master, "8888": filer}
        self.clone = folder / "clone"
        self.clone.mkdir()
        shutil.copytree(ROOT / "deploy", self.clone / "deploy")
        shutil.copy(ROOT / "docker-compose.yml", self.clone)
        programs = folder / "programs"
        programs.mkdir()
        _write_program(programs / "sudo", 'exec "$@"')
        _write_program(programs / "docker", f'exec {sys.executable} {Path(__file__).with_name("docker.py")} "$@"')
        self._path = f"{programs}:{os.environ['PATH']}"

    @property
    def url(self) -> str:
        """The URL of the published port of the service."""
        return f"http://127.0.0.1:{self.ports['8080']}"

    def type(self, line: str) -> str:
        """Run a line of the comments, and return what it prints on stdout; JOB is the job submitted last."""
        if line.startswith("export "):
            self.env |= dict(word.split("=", 1) for word in line.split()[1:])
            return ""
        if line.startswith("docker compose up "):
            self._up(line.split()[3:])
            return ""
        if line == "docker compose down --volumes":
            self.down()
            shutil.rmtree(self.folder / "volumes")
            return ""
        line = re.sub(r"\bJOB\b", self.job_id, line)
        env = {**os.environ, **self.env, "PATH": self._path, "COMPOSITION": str(self.folder / "state.json")}
        ran = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", line],
            cwd=self.clone,
            env=env,
            capture_output=True,
            text=True,
            check=False,
        )
        logs = "".join(f"{one.service}: {one.log.read_text(errors='replace')[-2000:]}\n" for one in self._all())
        assert ran.returncode == 0, f"{line}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}\n{logs}"
        for job_id in re.findall(r"^(\w+) (?:queued|probing)$", ran.stderr, re.MULTILINE):
            self.job_id = job_id
        return ran.stdout

    def down(self) -> None:
        for container in reversed(list(self._all())):
            container.stop()
        self.containers.clear()

    def _all(self) -> Iterator[Container]:
        for containers in self.containers.values():
            yield from containers

    def _up(self, options: list[str]) -> None:
        """Start what is described and not up, in the order of what waits for what, and run what runs once again."""
        scale = {}
        if "--scale" in options:
            at = options.index("--scale")
            name, _, number = options[at + 1].partition("=")
            scale[name] = int(number)
            del options[at : at + 2]
        assert set(options) == {"--detach", "--build", "--wait"}
        described = composed(self.clone, self.env)
        services = described["services"]
        for name in [name for name in _in_order(services) if name not in self.absent]:
            wanted = [self._container(described, name, number) for number in range(scale.get(name, 1))]
            if wanted != self.containers.get(name):
                for old in self.containers.pop(name, []):
                    old.stop()
                self.containers[name] = wanted
                for container in wanted:
                    container.start()
            for container in self.containers[name]:
                if services[name].get("restart") == "no":
                    code = container.finish()
                    assert code == 0, f"{name} ended with {code}: {container.log.read_text()}"
                    del self.containers[name]
                else:
                    container.wait_until_healthy()
        self._write_state(described)

    def _write_state(self, described: dict[str, Any]) -> None:
        """Write for the program `docker` what the containers have."""
        every = (self._container(described, name, 0) for name in described["services"] if name not in self.absent)
        state = {
            one.service: {
                "entrance": one.entrance,
                "env": one.whole_env,
                "mounts": {target: str(source) for target, (source, _) in one.mounts.items()},
                "volumes": [str(source) for source, writable in one.mounts.values() if writable],
                "log": str(one.log),
            }
            for one in every
        }
        (self.folder / "state.json").write_text(json.dumps(state))

    def _container(self, described: dict[str, Any], name: str, number: int) -> Container:
        service = described["services"][name]
        own = self.folder / f"{name}-{number}"
        own.mkdir(exist_ok=True)
        mounts: dict[str, tuple[Path, bool]] = {}
        for kind in ("secrets", "configs"):
            for one in service.get(kind, ()):
                target = one.get("target") or one["source"]
                source = Path(described[kind][one["source"]]["file"])
                mounts[target if target.startswith("/") else f"/run/secrets/{target}"] = source, False
        for one in service.get("volumes", ()):
            mounts[one["target"]] = self._volume(one)
        for one in service.get("tmpfs", ()):
            target = one.partition(":")[0]
            folder = own / target.strip("/").replace("/", "-")
            folder.mkdir(exist_ok=True)
            folder.chmod(0o1777)
            mounts[target] = folder, True
        env = {key: self._here(value) for key, value in (service.get("environment") or {}).items()}
        build = service.get("build")
        work_dir = work_dir_of(Path(build["context"], build["dockerfile"])) if build else "/"
        if name == "worker":
            env |= SLOTS
        if name == "redis":
            env["REDIS_PORT"] = self.ports["6379"]
        kind, *words = service.get("healthcheck", {"test": ["CMD"]})["test"]
        assert kind == "CMD"
        check = [self._here(word) for word in words]
        return Container(name, service, self._command(name, service), check, env, mounts, work_dir, own / "log")

    def _volume(self, volume: dict[str, Any]) -> tuple[Path, bool]:
        if volume["type"] == "bind":
            return Path(volume["source"]), not volume.get("read_only", False)
        folder = self.folder / "volumes" / volume["source"]
        folder.mkdir(parents=True, exist_ok=True)
        folder /= volume["volume"].get("subpath", "")
        assert folder.is_dir(), f"expected the folder {folder} in the volume, as Docker does, got none"
        return folder, True

    def _command(self, name: str, service: dict[str, Any]) -> list[str]:
        words = [self._here(word) for word in service["command"] or ()]
        if name == "redis":
            return [*words, "--port", self.ports["6379"], "--bind", "127.0.0.1"]
        if name == "database":
            return ["postgres-image", "-h", "127.0.0.1", "-p", self.ports["5432"], "-k", "/tmp", "-F"]
        if name == "store":
            return [*words, *(f"-{option}={port}" for option, port in self.stores.items())]
        if name == "proxy":
            return ["caddy-image", self.ports["443"], self.url, self.ports["2020"]]
        return words

    def _here(self, text: str) -> str:
        """Return a text with the addresses of containers as those of this machine."""
        text = re.sub(rf"\b({'|'.join(HOSTS)})(?=:\d)", "127.0.0.1", text)
        text = text.replace("0.0.0.0", "127.0.0.1").replace("10.229.19.2", "127.0.0.1")
        text = text.replace("https://localhost", f"https://localhost:{self.ports['443']}")
        return re.sub(r"\b(6379|5432|8333|8080|9333|8888|2020)\b", lambda found: self.ports[found[0]], text)


@contextmanager
def composition(folder: Path, *, without: Collection[str] = ()) -> Iterator[Composition]:
    """Yield a composition that nothing has started yet, and stop it at the end; services `without` are not started."""
    made = Composition(folder, without=without)
    try:
        yield made
    finally:
        made.down()


def _in_order(services: Mapping[str, Any]) -> list[str]:
    """Return the services, each after those for which it waits."""
    found: list[str] = []

    def add(name: str) -> None:
        for other in services[name].get("depends_on") or ():
            add(other)
        if name not in found:
            found.append(name)

    for name in services:
        add(name)
    return found


def _write_program(path: Path, line: str) -> None:
    path.write_text(f"#!/bin/sh\n{line}\n")
    path.chmod(0o755)
