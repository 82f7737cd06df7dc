"""The wheel in a fresh virtual environment: it has everything, with POV-Ray on the machine and without.

Its dependencies are those of the environment of the tests, which a .pth file lends: to download and install all of them
anew would take minutes and a network. Of the source tree nothing is lent, because a path in a .pth file does not apply
the .pth files in it, so not the one of the editable installation either. The decoder of pictures sees only its own
environment from inside its sandbox, so its two packages lie in it.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np
import pytest

from lippmann.client import Client
from lippmann.client.address import read_farm_file
from tests.farm import ended
from tests.needs import need_to_run, needs_povray
from tests.repository import DOCS, ROOT
from tests.waiting import ENOUGH_S
from worker.images.write import write_png

SMALL = ["--set", "rig.px_per_lens=2", "--set", "rig.lens_array.count=[4,4]"]


@dataclass(frozen=True)
class Installed:
    """An installed wheel, and an empty folder to work in."""

    wheel: Path
    environment: Path
    folder: Path

    def run(self, *arguments: str, path: str) -> subprocess.CompletedProcess[str]:
        ran = subprocess.run(
            [self.environment / "bin" / "lippmann", *arguments], cwd=self.folder, env=self.variables(path),
            capture_output=True, text=True, timeout=ENOUGH_S,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stderr
        return ran

    def variables(self, path: str) -> dict[str, str]:
        return {"HOME": str(self.folder), "LANG": "C.UTF-8", "PATH": f"{self.environment / 'bin'}:{path}"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    place = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    need_to_run([*pip, "--version"], what="pip is not installed")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(place)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = place.glob("*.whl")
    fresh = place / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", fresh], check=True)
    ours, packages = Path(sysconfig.get_path("purelib")), Path(sysconfig.get_path("purelib", vars={"base": str(fresh)}))
    (packages / "lent.pth").write_text(f"{ours}\n")
    for package in ours.glob("numpy*"):
        shutil.copytree(package, packages / package.name, copy_function=link)
    shutil.copytree(ours / "OpenImageIO", packages / "OpenImageIO", copy_function=link)
    install = [*pip, "--python", str(fresh), "install", "--quiet", "--no-index", "--no-deps", "--force-reinstall"]
    subprocess.run([*install, str(wheel)], check=True)
    (place / "work").mkdir()
    return Installed(wheel, fresh, place / "work")


def link(source: str, target: str) -> None:
    """Copy a file of an environment; a hard link takes no time, and needs the same file system."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


@pytest.fixture(scope="module")
def without_povray(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A PATH on which there is the sandbox and nothing else."""
    folder = tmp_path_factory.mktemp("bin")
    (folder / "bwrap").symlink_to("/usr/bin/bwrap")
    return str(folder)


def test_the_wheel_has_every_file_of_the_packages_and_the_pages_of_the_documentation(installed: Installed) -> None:
    packages = {name for folder in ("lippmann", "service", "worker", "povtemplates") for name in files_of(folder)}
    pages = {name for name in files_of("docs") if not name.endswith(".py")}
    with zipfile.ZipFile(installed.wheel) as wheel:
        held = {name for name in wheel.namelist() if ".dist-info/" not in name}
        described = next(name for name in wheel.namelist() if name.endswith("METADATA"))
        metadata = wheel.read(described).decode()
    assert held == packages | {name.replace("docs/", "lippmann/documentation/pages/", 1) for name in pages}
    assert "Provides-Extra: standalone" in metadata


def files_of(folder: str) -> list[str]:
    found = (file.relative_to(ROOT) for file in (ROOT / folder).rglob("*") if file.is_file())
    return [file.as_posix() for file in found if "__pycache__" not in file.parts]


def test_it_runs_from_the_environment_and_shows_its_documentation(installed: Installed, without_povray: str) -> None:
    listed = json.loads(installed.run("docs", "--list", "--json", path=without_povray).stdout)
    assert len(listed) == len(list(DOCS.rglob("*.md")))
    shown = json.loads(installed.run("docs", "printing", "--no-open", "--json", path=without_povray).stdout)
    assert (Path(shown["file"]).parent / "images" / "calibration.webp").is_file()
    assert Path(shown["file"]).is_relative_to(installed.folder)


@needs_povray
def test_it_renders_with_the_povray_of_the_machine(installed: Installed) -> None:
    installed.run("capture", "target-white", *SMALL, "--out", "white", path=os.defpath.removeprefix(":"))
    assert (installed.folder / "white" / "orthoscopic" / "0001.png").stat().st_size > 0


def test_without_povray_pictures_are_imported_and_viewed(installed: Installed, without_povray: str) -> None:
    sheet(installed.folder / "sheet.png")
    installed.run("import", "sheet.png", "--pitch-px", "4", "--out", "out", path=without_povray)
    installed.run("view", "out/orthoscopic/0001.exr", "--centre", "--out", "centre.png", path=without_povray)
    installed.run("refocus", "out/orthoscopic/0001.exr", "--depth-mm", "1", "--out", "near.png", path=without_povray)
    python = [str(installed.environment / "bin" / "python"), "-c", LIBRARY]
    ran = subprocess.run(
        python, cwd=installed.folder, env=installed.variables(without_povray), capture_output=True, text=True
    )
    assert (ran.returncode, ran.stdout) == (0, f"(4, 4, 8, 8, 3) {installed.environment}\n"), ran.stderr


LIBRARY = """
import sys, lippmann
image = lippmann.IntegralImage.open("out/orthoscopic/0001.exr")
assert lippmann.__file__.startswith(sys.prefix), lippmann.__file__
print(image.views().shape, sys.prefix)
"""


def test_without_povray_a_farm_shows_integral_images_that_exist(installed: Installed, without_povray: str) -> None:
    sheet(installed.folder / "own.png")
    installed.run("import", "own.png", "--pitch-px", "4", "--bundle", "own", "--out", ".", path=without_povray)
    with farm(installed, without_povray) as (client, link, notes):
        assert "expected POV-Ray as 'povray' on PATH" in notes
        assert {scene.name for scene in client.scenes()} >= {"fish", "target-white"}
        installed.run("scenes", "upload", "own", path=without_povray)
        job = client.submit({"scene": "own", "outputs": []})
        assert ended(client, job.id).status == "done"
        client.download_picture(job.id, 1, "view", installed.folder / "view.png", u=1, v=1)
        with httpx.Client(follow_redirects=True) as browser:
            assert "page.js" in browser.get(link).text, "the dashboard"
            assert "The HTTP API" in browser.get(f"{client.address.url}/docs").text


def sheet(file: Path) -> None:
    """Draw an integral image of 8 x 8 lenses of 4 px."""
    write_png(file, np.random.default_rng(1).random((32, 32, 3)))


@contextmanager
def farm(installed: Installed, path: str) -> Iterator[tuple[Client, str, str]]:
    """Run `lippmann up` of the wheel; gives a client, the link to the dashboard, and the notes so far."""
    notes = installed.folder / "notes.txt"
    with notes.open("w") as stderr, subprocess.Popen(
        [installed.environment / "bin" / "lippmann", "up", "--json", "--port", "0", "--slots", "1"],
        cwd=installed.folder, env=installed.variables(path), stdout=subprocess.PIPE, stderr=stderr, text=True,
    ) as up:  # fmt: skip
        try:
            assert up.stdout is not None
            line = up.stdout.readline()
            assert line, notes.read_text()
            address = read_farm_file(installed.folder / "data")
            assert address is not None
            with Client(address.url, address.key) as client:
                yield client, json.loads(line)["login_url"], notes.read_text()
        finally:
            up.send_signal(signal.SIGINT)
