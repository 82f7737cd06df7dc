"""The message for a command that was called in a wrong way, in the words of the other messages."""

from __future__ import annotations

from typing import Any

import typer


def usage_error_text(error: typer.TyperException) -> str:
    """Return the message of an error of typer: the option or argument, what was expected and what came."""
    context: Any = getattr(error, "ctx", None)
    if context is None:
        return f"lippmann: {error.format_message()}"
    text = error.format_message()
    if text == context.get_help():  # The command has sub-commands, and none was named.
        return text
    return f"lippmann: {_problem(error) or text}\n`{context.command_path} -h` shows how to call it."


def _problem(error: Any) -> str | None:
    """Return what was expected of a value and what came, if typer refused a value."""
    if not isinstance(error, typer.BadParameter) or error.__cause__ is None:
        return None
    from pydantic import ValidationError

    from lippmann.job.fields.problem_words import expected_words, got_words

    if error.param is None or not isinstance(error.__cause__, ValidationError):
        return None
    item: Any = error.__cause__.errors()[0]
    name = error.param.opts[0] if error.param.param_type_name == "option" else error.param.metavar or error.param.name
    choices = error.param.type_descriptor.choices
    expected = f"one of {', '.join(map(str, choices))}" if choices else expected_words(item)
    return f"{name}: expected {expected}, got {got_words(item['input'])}"
