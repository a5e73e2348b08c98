"""The reference of the command line, from the declarations of its commands."""

import inspect
from enum import Enum
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import typer.main

from pftrack.cli.app import app

__all__ = ["commands", "markdown"]


def commands() -> list[tuple[str, Any]]:
    """Return every command with its full name, those in a group after the group."""
    found: list[tuple[str, Any]] = []
    _collect("pftrack", typer.main.get_command(app), found)
    return found


def _collect(name: str, command: Any, found: list[tuple[str, Any]]) -> None:
    found.append((name, command))
    if hasattr(command, "list_commands"):
        context = _context(name, command)
        for each in command.list_commands(context):
            _collect(f"{name} {each}", command.get_command(context, each), found)


def _context(name: str, command: Any) -> Any:
    return command.context_class(command, info_name=name)


def markdown() -> str:
    """Return the reference as Markdown, with a section per command."""
    return "\n\n".join(_section(name, command) for name, command in commands())


def _section(name: str, command: Any) -> str:
    usage = " ".join([name, *command.collect_usage_pieces(_context(name, command))])
    parts = [f"## `{name}`", inspect.cleandoc(command.help or "").replace("\b", ""), f"```text\n{usage}\n```"]
    rows = [_row(each) for each in command.params if not each.hidden and "--help" not in each.opts]
    if rows:
        parts.append("| | type | default | meaning |\n|---|---|---|---|\n" + "\n".join(rows))
    return "\n\n".join(parts)


def _row(parameter: Any) -> str:
    names = [f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts)]
    default = "required" if parameter.required else _default(parameter)
    cells = ", ".join(names), _type(parameter), default, parameter.help or ""
    return f"| {' | '.join(_cell(cell) for cell in cells)} |"


def _type(parameter: Any) -> str:
    kind = parameter.type_descriptor.annotation
    several = get_origin(kind) is list
    if several:
        (kind,) = get_args(kind)
    if kind is bool:
        return ""
    names = {int: "whole number", float: "number", str: "text", Path: "path"}
    if get_origin(kind) is Literal:
        word = ", ".join(f"`{value}`" for value in get_args(kind))
    elif issubclass(kind, Enum):
        word = ", ".join(f"`{value.value}`" for value in kind)
    else:
        word = names.get(kind, kind.__name__)
    bounds = (("from", parameter.min), ("to", parameter.max))
    words = [word, *(f"{side} {bound:g}" for side, bound in bounds if bound is not None)]
    return " ".join(words) + ("; may be repeated" if several else "")


def _default(parameter: Any) -> str:
    value = parameter.default
    if value is None or callable(value) or value in ((), [], "", False):
        return ""
    return "yes" if value is True else f"`{value}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
