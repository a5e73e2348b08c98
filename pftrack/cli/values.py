"""Values of parameters as a command line gives them: NAME=VALUE, and NAME=@FILE for one that is a file's text."""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from pftrack.cli.output import CommandError, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Parameters, Value

__all__ = ["assign", "text_of", "value_of", "values_of"]


def assign(assignment: str) -> tuple[str, str]:
    """Return name and text of NAME=VALUE."""
    name, separator, text = assignment.partition("=")
    if not (separator and name):
        raise wrong_use(f"--set expected name=value, got {assignment!r}")
    return name, text


def values_of(parameters: "Parameters", assignments: Sequence[str]) -> "dict[str, Value]":
    """Return the values that assignments NAME=VALUE give to parameters; an unknown name is wrong use."""
    from pftrack.core.model.parameters import declarations

    model = type(parameters)
    known = [declaration.name for declaration in declarations(model)]
    values: dict[str, Value] = {}
    for name, text in map(assign, assignments):
        if name not in known:
            near = get_close_matches(name, known, n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`pftrack show` lists them"
            raise wrong_use(f"there is no parameter {name!r}; {hint}")
        values[name] = value_of(model, name, text)
    return values


def value_of(model: "type[Parameters]", name: str, text: str) -> "Value":
    """Read a value; that of a parameter which is a file's text may be the file, @FILE.

    Raises:
        ParameterError: The name is unknown or the text is no value of its kind.
    """
    from pftrack.core.model.parameters import declarations, parse

    kinds = {declaration.name: declaration.kind for declaration in declarations(model)}
    if kinds.get(name) == "file" and text.startswith("@"):
        return text_of(Path(text[1:]))
    return parse(model, name, text)


def text_of(path: Path) -> str:
    """Return the text of a file that is to be the value of a parameter."""
    from pftrack.core.model.parameters import LONGEST_FILE

    try:
        if path.stat().st_size > 4 * LONGEST_FILE:  # of which a character takes four bytes at most
            raise CommandError(f"{path} is too large: such a file has at most {LONGEST_FILE} characters")
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CommandError(f"there is no file {path}") from None
    except UnicodeDecodeError:
        raise CommandError(f"{path} is no text") from None
    if not text.strip():  # which as a value would mean that there is no file
        raise CommandError(f"{path} is empty")
    return text
