"""Many modules as one: it does what they do, and says what it cannot join."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from service.dashboard.assets import assets
from service.dashboard.bundle import bundled_modules

NODE = Path(sys.executable).parent / "node"

GRAPH = {
    "app.js": 'import { Shape as Form, area } from "./shapes/area.js";\nimport path from "node:path";\n'
    'import { log } from "./log.js";\nimport "./effect.js";\n\nconst name = "app";\n'
    'log(name, area(new Form(3)), path.posix.basename("/a/b"));\n',
    "shapes/area.js": 'import { log } from "../log.js";\n\nconst name = "area";\nexport class Shape {\n'
    "  constructor(side) {\n    this.side = side;\n  }\n}\n"
    "export function area({ side }) {\n  log(name);\n  return side ** 2;\n}\n",
    "log.js": "const told = [];\nexport const log = (...words) => {\n  told.push(...words);\n"
    '  console.log(told.join(" "));\n};\n',
    "effect.js": 'import { log } from "./log.js";\nlog("effect");\n',
}
"""Modules with the same names inside, a module that two others use, and one that is imported for its effect."""


def test_the_bundle_does_what_its_modules_do(tmp_path: Path) -> None:
    for name, text in GRAPH.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "bundle.js").write_text(bundled_modules("app.js", GRAPH))
    said = [subprocess.check_output([NODE, tmp_path / name], text=True) for name in ("app.js", "bundle.js")]
    assert said[0] == said[1] == "effect\neffect area\neffect area app 9 b\n"


def test_the_bundle_of_the_page_is_a_module(tmp_path: Path) -> None:
    page = tmp_path / "page.mjs"
    page.write_bytes(assets()["page.js"].body)
    subprocess.check_call([NODE, "--check", page])


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ('import { a } from "./a.js";\n', "expected no circle of imports, got a.js -> b.js -> a.js"),
        ('import { c } from "./c.js";\n', "b.js: expected to import a module that is there, got 'c.js'"),
        ('import * as c from "./a.js";\n', "b.js: expected imports and exports as .* got 'import . as c"),
        ("export default 3;\n", "got 'export default 3;'"),
        ("export let b = 3;\n", "got 'export let b = 3;'"),
        ("export const { b } = {};\n", "got 'export const { b } = {};'"),
        ('export { b } from "./a.js";\n', "got 'export { b }"),
        ('const later = () => import("./a.js");\n', 'got \'import."./a.js"'),
    ],
)
def test_what_cannot_be_joined_is_said(module: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        bundled_modules("a.js", {"a.js": 'import { b } from "./b.js";\n', "b.js": module})
