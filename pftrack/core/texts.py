"""Texts that people read and mend, such as presets and the glossary: YAML files beside what they speak of."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The same, ten times faster, where PyYAML was built with libyaml."""


def read_texts(path: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
    """Return what a YAML file declares under its names, and where each of them stands, as "folder/file, line N".

    Raises:
        ValueError: The file is not YAML, or it does not map names to what it declares; it names file and line.
    """
    place = f"{path.parent.name}/{path.name}"
    text = path.read_text(encoding="utf-8")
    try:
        declared = yaml.load(text, Loader=_LOADER)  # noqa: S506 - both loaders are safe
        if not isinstance(declared, dict):
            got = type(declared).__name__
            raise ValueError(f"{place} must map names to what they declare, got {got}")  # noqa: TRY004 - of a file
        root = yaml.compose(text, Loader=_LOADER)
    except yaml.YAMLError as error:
        raise ValueError(f"{place} is not YAML: {error}") from error
    return declared, {key.value: f"{place}, line {key.start_mark.line + 1}" for key, _ in root.value}


CLOSED = ConfigDict(extra="forbid")
"""Of a dataclass that a file declares: pydantic refuses what is not one of its fields."""

T = TypeVar("T")

PROBLEMS = {"unexpected_keyword_argument": "has an unknown field {place!r}", "missing": "lacks {place!r}"}


def read_as(kind: type[T], path: Path, key: str) -> tuple[T, ...]:
    """Return what a YAML file maps its names to, as objects of a dataclass.

    Args:
        kind: The dataclass, with a field `origin` for file and line.
        path: The file.
        key: The field that takes the name.

    Raises:
        ValueError: The file is not YAML, or a field is unknown, missing or wrong; it names file and line.
    """
    declared, places = read_texts(path)
    adapter, read = TypeAdapter(kind), []
    for name, values in declared.items():
        try:
            read.append(adapter.validate_python({**values, key: name, "origin": places[name]}))
        except ValidationError as error:
            # A misspelt field is both unknown and missing, and of that the first says more.
            first = min(error.errors(), key=lambda each: each["type"] == "missing")
            place = ".".join(map(str, first["loc"]))
            problem = PROBLEMS.get(first["type"], "has a wrong {place!r}: {msg}").format(place=place, msg=first["msg"])
            raise ValueError(f"{places[name]}: {name} {problem}") from error
    return tuple(read)
