"""Help texts: plain lines of at most 80 columns, so that a command fits on one screen.

A list of commands gives the first sentence of each. The help of a command gives its whole text, its arguments and
options, and an example.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

WIDTH = 80
LEFT_COLUMN = 26
"""The widest left column, in characters; a longer entry has its text below it."""

SHORTER: Mapping[str, str] = {"show_completion": "Show completion for the current shell, to copy it."}
"""Texts of typer that would take two lines, by the names of their options."""

EXAMPLES: Mapping[str, str] = {
    "up": "lippmann up --open",
    "demo": "lippmann demo --frames 1-45",
    "serve": "lippmann serve --key-file admin.key",
    "worker": "lippmann worker --join render7.toml --slots 4",
    "workers drain": "lippmann workers drain render-7 --exit",
    "workers exclude": "lippmann workers exclude render-7",
    "workers forgive": "lippmann workers forgive render-7",
    "top": "lippmann top --once --json",
    "keys create": "lippmann keys create alice --role submitter --days 90",
    "keys revoke": "lippmann keys revoke 3f2a90c1d4e5",
    "keys audit": "lippmann keys audit --limit 20",
    "backup": "lippmann backup /backups/monday",
    "restore": "lippmann restore /backups/monday --data-dir data",
    "submit": "lippmann submit job.json --set rig.px_per_lens=4 --watch",
    "jobs": "lippmann jobs --status running",
    "tasks": "lippmann tasks JOB --status ready",
    "logs": "lippmann logs JOB --status failed",
    "link": "lippmann link JOB video/views.mp4",
    "skip": "lippmann skip JOB --frames 7,12-14",
    "priority": "lippmann priority JOB 80",
    "scenes show": "lippmann scenes show fish",
    "scenes init": "lippmann scenes init my-scene/scene.pov",
    "scenes upload": "lippmann scenes upload my-scene/",
    "scenes rm": "lippmann scenes rm my-scene",
    "capture": "lippmann capture my-scene/ --frame 3 --out out --set rig.px_per_lens=4",
    "preview": "lippmann preview my-scene/ --out out --set rig.lens_array.offset_mm=20",
    "import": "lippmann import scan.png --find-from white.png --out out",
    "orthoscopic": "lippmann orthoscopic integral/0001.exr --out upright.exr",
    "view": "lippmann view out/orthoscopic/0001.exr --eye 20,0,400 --out eye.png",
    "refocus": "lippmann refocus out/orthoscopic/0001.exr --depth-mm 40 --out fish.png",
    "depth": "lippmann depth out/orthoscopic/0001.exr --out depth.png",
    "observe": "lippmann observe out/orthoscopic/0001.exr --eye 0,0,500 --stereo anaglyph --out eyes.png",
    "export": 'lippmann export JOB quilt.png views.webm \'{"kind": "epi"}\' --out out',
    "compare": "lippmann compare out/orthoscopic/0001.exr coded/0001.png",
    "coding-study": "lippmann coding-study JOB --codecs x264,x265,svtav1 --qp 22,27,32,37 --out study",
    "design": "lippmann design job.json --svg bench.svg",
    "lens": "lippmann lens double-gauss-tronnier --focal-length-mm 300 --f-number 4",
    "calibration-sheet": "lippmann calibration-sheet --pitch-mm 1.0 --dpi 600 --out sheet.pdf",
    "paper fig7": "lippmann paper fig7 --out out/paper",
    "paper fig8": "lippmann paper fig8 --quick",
    "docs": "lippmann docs printing",
}
"""The example of each command that has one, which docs/command.md explains."""

_UNITS: Mapping[str, str] = {"_mm": "MM", "_um": "MICROMETRES", "_px": "PX", "_deg": "DEGREES", "_percent": "PERCENT"}


class PlainCommand(TyperCommand):
    """A command whose help is plain text."""

    def get_help(self, ctx: Any) -> str:
        """Return the help: how to call the command, its text, its arguments and options, and an example."""
        parameters = [one for one in self.get_params(ctx) if not getattr(one, "hidden", False)]
        arguments = [one for one in parameters if one.param_type_name == "argument"]
        options = [one for one in parameters if one.param_type_name == "option"]
        parts = [
            _usage(ctx.command_path, [*arguments, *(one for one in options if one.required)]),
            _text(self.help or ""),
            _section("Arguments", [(_name(one), _explain(one)) for one in arguments]),
            _section("Options", [(_name(one), _explain(one)) for one in options]),
        ]
        example = EXAMPLES.get(ctx.command_path.partition(" ")[2])
        if example:
            parts.append(f"Example:\n  {example}")
        return "\n\n".join(filter(None, parts))


class PlainGroup(TyperGroup):
    """A command with sub-commands whose help is plain text, a section for each of their panels."""

    def get_help(self, ctx: Any) -> str:
        """Return the help: the sub-commands with the first sentence of each."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command: Any = self.get_command(ctx, name)
            if not command.hidden:
                panel = command.rich_help_panel
                sections.setdefault(panel if isinstance(panel, str) else "Commands", []).append(
                    (name, first_sentence(command.help or ""))
                )
        width = max(len(name) for rows in sections.values() for name, _ in rows)
        options = [(_name(one), SHORTER.get(str(one.name)) or _explain(one)) for one in self.get_params(ctx)]
        parts = [
            f"Usage: {ctx.command_path} COMMAND ...",
            _text(self.help or ""),
            "\n".join(_section(panel, rows, width=width) for panel, rows in sections.items()),
            _section("Options", options),
            f"`{ctx.command_path} COMMAND -h` shows the options of a command.",
        ]
        return "\n\n".join(parts)


def use_plain_help(app: typer.Typer) -> None:
    """Let all commands and groups of an app, which are registered already, have plain help."""
    for command in app.registered_commands:
        command.cls = PlainCommand
    for group in app.registered_groups:
        group.cls = PlainGroup
        if group.typer_instance is not None:
            use_plain_help(group.typer_instance)


def first_sentence(text: str) -> str:
    """Return the first sentence of a text.

    >>> first_sentence("Repeat the experiments of Athineos et al. 2006. Each takes minutes.")
    'Repeat the experiments of Athineos et al. 2006.'
    """
    return re.split(r"(?<=[.])\s+(?=[A-Z`])", text.strip(), maxsplit=1)[0]


def _usage(path: str, needed: Iterable[Any]) -> str:
    words = [f"{one.opts[0]} {_value(one)}" if one.param_type_name == "option" else _name(one) for one in needed]
    return _wrap(" ".join(["Usage:", path, *words, "[OPTIONS]"]), hang=7)


def _text(text: str) -> str:
    paragraphs = re.split(r"\n\s*\n", text.strip())
    return "\n\n".join(_wrap(" ".join(paragraph.split())) for paragraph in paragraphs)


def _section(title: str, rows: Sequence[tuple[str, str]], *, width: int | None = None) -> str:
    if not rows:
        return ""
    left = width or max((len(name) for name, _ in rows if len(name) <= LEFT_COLUMN), default=LEFT_COLUMN)
    return "\n".join([f"{title}:", *(line for row in rows for line in _row(*row, left=left))])


def _row(name: str, text: str, *, left: int) -> Iterator[str]:
    lines = _wrap(text, width=WIDTH - left - 4).splitlines() or [""]
    if len(name) > left:
        yield f"  {name}"
    else:
        yield f"  {name.ljust(left)}  {lines.pop(0)}".rstrip()
    for line in lines:
        yield f"{'':{left + 4}}{line}"


def _name(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        name = _value(parameter)
        return name if parameter.required else f"[{name}]"
    # The long name comes first, and a flag has no value.
    names = [" / ".join((*sorted(parameter.opts, key=len, reverse=True), *parameter.secondary_opts))]
    if not parameter.is_flag:
        names.append(_value(parameter))
    return " ".join(names)


def _value(parameter: Any) -> str:
    """Return the word for the value of an argument or an option."""
    if parameter.metavar:
        return str(parameter.metavar)
    name = parameter.name
    if parameter.param_type_name == "argument":
        return str(name).upper()
    kind = parameter.type_descriptor
    if kind.is_choice:
        return "|".join(str(choice) for choice in kind.choices)
    for ending, unit in _UNITS.items():
        if name.endswith(ending):
            return unit
    if kind.is_path:
        return "FOLDER" if re.match(r"The (data )?folder", parameter.help or "") else "FILE"
    return "N" if kind.annotation in (int, float) else str(name).upper()


def _explain(parameter: Any) -> str:
    """Return the help of a parameter with its limits, its variable of the environment and its default."""
    facts = []
    if parameter.min is not None and parameter.max is not None:
        facts.append(f"{parameter.min:g} to {parameter.max:.15g}")
    elif parameter.min is not None and parameter.min > 1:
        facts.append(f"at least {parameter.min:g}")
    if parameter.envvar:
        facts.append(str(parameter.envvar))
    default = parameter.default
    if parameter.param_type_name == "option" and parameter.is_flag:
        default = parameter.opts[0] if default and parameter.secondary_opts else None
    if default not in (None, "") and not callable(default) and getattr(parameter, "show_default", True):
        facts.append(f"default: {default:g}" if isinstance(default, float) else f"default: {default}")
    if parameter.required and parameter.param_type_name == "option":
        facts.append("required")
    return " ".join(filter(None, [parameter.help, f"[{'; '.join(facts)}]" if facts else ""]))


def _wrap(text: str, *, width: int = WIDTH, hang: int = 0) -> str:
    # "default: data" stays on one line.
    text = text.replace(": ", ":\0") if "[" in text else text
    filled = textwrap.fill(text, width, subsequent_indent=" " * hang, break_long_words=False, break_on_hyphens=False)
    return filled.replace("\0", " ")
