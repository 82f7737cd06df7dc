"""The modules of the dashboard as one file, and its style sheets as another, so that a browser sends few requests.

The source files stay as they are: nobody runs a build. A module becomes a function that returns its exports, after the
modules that it imports; packages of others are imported as before. Modules are written so that this is enough:

* imports stand at the start of a line: `import { a, b as c } from "./x.js";`, `import a from "x";`, `import "./x.js";`
* exports are named declarations: `export const`, `export function`, `export async function`, `export class`
* no module imports itself in a circle, none is imported later by `import()`, none awaits outside of functions
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Mapping

_IMPORT = re.compile(r'^import (?:(?:\{(?P<names>[^}]*)\}|(?P<default>\w+)) from )?"(?P<source>[^"]+)";', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:const|function|async function|class) (?P<name>\w+))", re.MULTILINE)
_OTHER = re.compile(r"^(?:import|export)\b[^\n]*|\bimport\([\"'`]\.[^\n]*", re.MULTILINE)


def bundled_modules(entry: str, modules: Mapping[str, str]) -> str:
    r"""Return a module and all that it imports as one module.

    Parameters
    ----------
    entry
        The name of the module that starts.
    modules
        The texts of the modules, by their names from one folder: `jobs/job.js`.

    Raises
    ------
    ValueError
        If modules import each other in a circle, one is not there, or one is not written as this module describes.

    Examples
    --------
    >>> modules = {"a.js": 'import { b } from "./b.js";\nb();\n', "b.js": "export const b = f;\n"}
    >>> print(bundled_modules("a.js", modules))
    const b_js = (() => {
    const b = f;
    return { b };
    })();
    const a_js = (() => {
    const { b } = b_js;
    b();
    return {};
    })();
    <BLANKLINE>
    """
    packages = dict[str, str]()
    parts = [_as_function(name, modules[name], packages) for name in _in_order(entry, modules)]
    imports = [f'import * as {name} from "{source}";\n' for source, name in packages.items()]
    return "".join((*imports, *parts))


def joined_sheets(sheets: Iterable[str]) -> str:
    """Return style sheets as one, in their order."""
    return "\n".join(sheets)


def _in_order(entry: str, modules: Mapping[str, str]) -> list[str]:
    """Return the names of a module and of all that it imports, each after those that it imports."""
    ordered: list[str] = []
    path: list[str] = []

    def visit(name: str, importer: str) -> None:
        if name in path:
            raise ValueError(f"expected no circle of imports, got {' -> '.join((*path, name))}")
        if name in ordered:
            return
        if name not in modules:
            raise ValueError(f"{importer}: expected to import a module that is there, got {name!r}")
        path.append(name)
        for found in _IMPORT.finditer(modules[name]):
            if found["source"].startswith("."):
                visit(_resolved(found["source"], name), name)
        ordered.append(path.pop())

    visit(entry, "the page")
    return ordered


def _as_function(name: str, text: str, packages: dict[str, str]) -> str:
    """Return a module as the constant that has its exports; name the packages that it imports."""

    def constant(found: re.Match[str]) -> str:
        source = found["source"]
        if source.startswith("."):
            origin = _identifier(_resolved(source, name))
        else:
            origin = packages.setdefault(source, f"package_{_identifier(source)}")
        names = f" default: {found['default']} " if found["default"] else (found["names"] or "").replace(" as ", ": ")
        return f"const {{{names}}} = {origin};"

    exported = [found["name"] for found in _EXPORT.finditer(text)]
    body = _EXPORT.sub("", _IMPORT.sub(constant, text))
    if other := _OTHER.search(body):
        raise ValueError(f"{name}: expected imports and exports as {__name__} describes them, got {other[0]!r}")
    returned = f"{{ {', '.join(exported)} }}" if exported else "{}"
    return f"const {_identifier(name)} = (() => {{\n{body}return {returned};\n}})();\n"


def _resolved(source: str, importer: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(importer), source))


def _identifier(name: str) -> str:
    return re.sub(r"\W", "_", name)
