"""Documents: a Markdown file with a head in YAML, read so that whatever is wrong can be told by its line.

    ---
    id: ...
    ---
    The idea, as text.

A file may come from anybody: its size is limited before it is read, nothing in its head refers to another place of it,
and its head is neither deep nor of kinds other than those of JSON.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import yaml

__all__ = ["EXPONENT", "LARGEST_BYTES", "Document", "DocumentError", "Place", "decode", "document_of", "read_source"]

LARGEST_BYTES: Final = 32 * 1024
DEEPEST: Final = 12
LARGEST_NUMBER: Final = 10**30
"""Of whole numbers; no field takes one so large, and one of thousands of digits cannot even be told."""
FENCE: Final = "---"
EXPONENT: Final = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d{1,3}")
"""A number, which YAML 1.1 takes for a text unless it has a point and a sign."""

Place: TypeAlias = "tuple[str | int, ...]"
"""The keys and numbers that lead to a value of the head."""


class DocumentError(ValueError):
    """What is wrong in a file.

    Attributes:
        line: Where, from 1; 0 of the whole file.
        message: What, and what to do.
    """

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line
        self.message = message


@dataclass(frozen=True, slots=True)
class Document:
    """A file that was read.

    Attributes:
        head: Its values.
        lines: Of the values, and of keys, from 1.
        text: What follows the head.
        text_line: Where that begins.
        source: All of the file.
    """

    head: Mapping[str, Any]
    lines: Mapping[Place, int]
    text: str
    text_line: int
    source: str

    def line(self, place: Place) -> int:
        """Return where a value stands, or what it would be a part of."""
        while place and place not in self.lines:
            place = place[:-1]
        return self.lines.get(place, 1)


def read_source(path: Path) -> bytes:
    """Return the content of a file.

    Raises:
        DocumentError: It is too large.
        OSError: It cannot be read.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST_BYTES + 1)
    if len(data) > LARGEST_BYTES:
        raise DocumentError(0, f"the file is larger than {LARGEST_BYTES // 1024} KiB; its text fits on one screen")
    return data


def decode(data: bytes) -> str:
    """Return the text of a file's content.

    Raises:
        DocumentError: It is none.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise DocumentError(line, "this is no UTF-8; save the file with that encoding") from None


def document_of(text: str) -> Document:
    """Read the text of a file.

    Raises:
        DocumentError: It has no head, or one that is none.
    """
    lines = text.splitlines()
    if not lines or lines[0].rstrip() != FENCE:
        raise DocumentError(1, f"the file begins with a head between two lines of {FENCE}; the first line is another")
    end = next((number for number, line in enumerate(lines[1:], 1) if line.rstrip() == FENCE), None)
    if end is None:
        raise DocumentError(1, f"the head that begins here has no end; close it with a line of {FENCE}")
    places: dict[Place, int] = {}
    head = _read("\n".join(lines[1:end]), places)
    body = lines[end + 1 :]
    blank = next((number for number, line in enumerate(body) if line.strip()), 0)
    return Document(head, places, "\n".join(body).strip(), end + 2 + blank, "\n".join(lines) + "\n")


def _read(text: str, places: dict[Place, int]) -> dict[str, Any]:
    """Return the values of a head, and note where they are; its first line is the file's second."""
    try:
        _check_events(text)
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        head = _build(node, (), loader, places) if node is not None else None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 2 if error.problem_mark else 1
        remedy = "put a text that has a : or a bracket into quotes, and indent with spaces"
        raise DocumentError(line, f"the head is no YAML: {error.problem}; {remedy}") from None
    except yaml.reader.ReaderError as error:
        line = text[: error.position].count("\n") + 2
        raise DocumentError(line, "there is a character that YAML does not allow") from None
    if not isinstance(head, dict):
        raise DocumentError(2, "the head is made of lines such as `id: my-lesson`")
    return head


def _check_events(text: str) -> None:
    """Refuse references, tags and depth, before anything is built that could grow."""
    depth = 0
    for event in yaml.parse(text, yaml.SafeLoader):
        line = event.start_mark.line + 2
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise DocumentError(line, "references (& and *) are not allowed here; write the value out, or in quotes")
        if getattr(event, "tag", None):
            raise DocumentError(line, f"the tag {event.tag} is not allowed here; write the value without it")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise DocumentError(line, f"the head is nested more than {DEEPEST} deep")


def _build(node: yaml.Node, place: Place, loader: yaml.SafeLoader, places: dict[Place, int]) -> Any:  # noqa: ANN401 - JSON
    places.setdefault(place, node.start_mark.line + 2)
    if isinstance(node, yaml.SequenceNode):
        return [_build(item, (*place, number), loader, places) for number, item in enumerate(node.value)]
    if isinstance(node, yaml.MappingNode):
        built: dict[str, Any] = {}
        for name, key, value in _pairs(node):
            if name in built:
                raise DocumentError(key.start_mark.line + 2, f"`{name}` is there twice; leave one out")
            places[(*place, name)] = key.start_mark.line + 2
            built[name] = _build(value, (*place, name), loader, places)
        return built
    try:
        value = loader.construct_object(node)
    except (ValueError, OverflowError):
        raise DocumentError(node.start_mark.line + 2, f"{node.value[:40]!r} is no value; put it in quotes") from None
    if isinstance(value, int) and abs(value) >= LARGEST_NUMBER:
        raise DocumentError(node.start_mark.line + 2, f"{node.value[:40]!r} is too large a number")
    if isinstance(value, bool) and node.value.lower() not in {"true", "false"}:
        return node.value
    if isinstance(value, str) and node.style is None and EXPONENT.fullmatch(value):
        return float(value)
    return value if isinstance(value, bool | int | float | str) else node.value


def _pairs(node: yaml.MappingNode) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise DocumentError(key.start_mark.line + 2, "a key is a plain word")
        yield key.value, key, value
