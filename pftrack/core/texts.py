"""Texts that people read and edit, such as presets and the glossary: YAML files next to their subject."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The same, ten times faster, where PyYAML was built with libyaml."""


def read_texts(path: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
    """Return the declarations of a YAML file by name, and the place of each, as "folder/file, line N".

    Entries of a mapping below a name are named, too, as "name.further name".

    Raises:
        ValueError: The file is not YAML, or it does not map names to what it declares; it names file and line.
    """
    place = f"{path.parent.name}/{path.name}"
    text = path.read_text(encoding="utf-8")
    try:
        loader = _LOADER(text)
        root = loader.get_single_node()
        declared = loader.construct_document(root) if root is not None else None
    except yaml.YAMLError as error:
        raise ValueError(f"{place} is not YAML: {error}") from error
    if not isinstance(declared, dict):
        got = type(declared).__name__
        raise ValueError(f"{place} must map names to what they declare, got {got}")  # noqa: TRY004 - of a file
    return declared, {name: f"{place}, line {line}" for name, line in _lines(root, "")}


def _lines(mapping: yaml.MappingNode, above: str) -> Iterator[tuple[str, int]]:
    for key, value in mapping.value:
        yield above + key.value, key.start_mark.line + 1
        if isinstance(value, yaml.MappingNode):
            yield from _lines(value, f"{above}{key.value}.")


CLOSED = ConfigDict(extra="forbid")
"""For a dataclass that a file declares: pydantic refuses unknown fields."""

Origin: TypeAlias = Annotated[str, Field(exclude=True)]
"""File and line of a declaration, hidden from answers and files."""

T = TypeVar("T")

UNKNOWN = "has an unknown field {place!r}"
PROBLEMS = {"unexpected_keyword_argument": UNKNOWN, "extra_forbidden": UNKNOWN, "missing": "lacks {place!r}"}


def refusal(error: ValidationError, places: Mapping[str, str], file: str, *above: str) -> ValueError:
    """Return the refusal of a file's declaration: file and line, its owner, and the first problem.

    Args:
        error: Pydantic's error.
        places: Places of names, as from `read_texts`.
        file: Text to use if the place is unknown.
        above: Names above the validated value in the file.
    """
    # A misspelt field is both unknown and missing; the first of these is more helpful.
    first = min(error.errors(), key=lambda each: each["type"] == "missing")
    way = (*above, *map(str, first["loc"]))
    known = next((n for n in range(len(way), 0, -1) if ".".join(way[:n]) in places), 0)
    whose = max(min(known, len(way) - 1), len(above))
    place = ".".join(way[whose:])
    problem = PROBLEMS.get(first["type"], "has a wrong {place!r}: {msg}" if place else "is wrong: {msg}")
    said = f"{'.'.join(way[:whose]) or file} {problem.format(place=place, msg=first['msg'])}"
    return ValueError(f"{places['.'.join(way[:known])] if known else file}: {said}")


def read_as(
    kind: type[T],
    path: Path,
    key: str,
    more: Mapping[str, Mapping[str, Any]] | None = None,
    passed: Sequence[str] = (),
) -> tuple[T, ...]:
    """Return what a YAML file maps its names to, as objects of a dataclass.

    Args:
        kind: The class; a field `origin` takes file and line.
        path: The file.
        key: The field that takes the name.
        more: By name, values of fields that no file can hold, such as functions.
        passed: Names that declare something else.

    Raises:
        ValueError: The file is not YAML, or a field is unknown, missing or wrong; it names file and line.
    """
    declared, places = read_texts(path)
    adapter, read = TypeAdapter(kind), []
    for name, values in ((name, values) for name, values in declared.items() if name not in passed):
        if not isinstance(values, dict):
            got = type(values).__name__
            raise ValueError(f"{places[name]}: {name} must map fields to values, got {got}")  # noqa: TRY004 - of a file
        origin = {"origin": places[name]} if "origin" in kind.__annotations__ else {}
        own = {key: name, **origin, **(more or {}).get(name, {})}
        try:
            read.append(adapter.validate_python({**values, **own}))
        except ValidationError as error:
            raise refusal(error, places, path.name, name) from error
    return tuple(read)


M = TypeVar("M", bound=BaseModel)


def read_whole(kind: type[M], path: Path) -> M:
    """Return what a YAML file declares as one object, whose fields are the file's names.

    Raises:
        ValueError: The file is not YAML, or a name is unknown, missing or wrong; it names file and line.
    """
    declared, places = read_texts(path)
    try:
        return kind.model_validate(declared)
    except ValidationError as error:
        raise refusal(error, places, f"{path.parent.name}/{path.name}") from error
