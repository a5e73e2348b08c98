"""Documents: a Markdown file with a head in YAML, read with line numbers for error messages.

    ---
    id: ...
    ---
    The idea, as text.

A file may come from anyone: its size is limited before it is read, its head has no references, limited depth, and only
the types of JSON. All problems are collected, so a file can be corrected in one go.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, Protocol, TypeAlias, TypeVar, get_args

import yaml
from pydantic import BaseModel, ValidationError

from pftrack.core.refusal import RefusedError

LARGEST_BYTES: Final = 32 * 1024
MOST_FILES: Final = 200
"""Largest number of files of a folder."""
DEEPEST: Final = 12
LARGEST_NUMBER: Final = 10**30
"""Largest number of digits of whole numbers; no field takes a larger one, and one of thousands of digits cannot even be
printed."""
FENCE: Final = "---"
LOADER: Final = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The same, ten times faster, where PyYAML was built with libyaml."""
EXPONENT: Final = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d{1,3}")
"""A number, which YAML 1.1 takes for a text unless it has a point and a sign."""

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Place: TypeAlias = "tuple[str | int, ...]"
"""The keys and numbers that lead to a value of the head."""


class DocumentError(ValueError):
    """A problem in a file.

    Attributes:
        line: Its line, from 1; 0 for the whole file.
        message: The problem and its remedy.
    """

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line
        self.message = message


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem of a lesson's or an exercise's file, or of a package of such files.

    Attributes:
        origin: The file's name, or the package's and the file's.
        line: Where, from 1; 0 of the whole file.
        message: The problem and its remedy, a sentence without a full stop.
    """

    origin: str
    line: int
    message: str

    @property
    def sentence(self) -> str:
        """All of it in one line."""
        return f"{self.origin}, line {self.line}: {self.message}" if self.line else f"{self.origin}: {self.message}"


@dataclass(frozen=True, slots=True)
class Document:
    """A file that was read.

    Attributes:
        head: Its values.
        lines: Lines of the values and keys, from 1.
        text: The text after the head.
        text_line: First line of that.
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


class Item(Protocol):
    """Result of a file: a lesson or an exercise."""

    @property
    def id(self) -> str:
        """Its name, different from all others."""

    @property
    def origin(self) -> str:
        """The file that it comes from."""


D = TypeVar("D", bound=Item)
Maker: TypeAlias = "Callable[[bytes, str], D | list[DocumentError]]"
"""(content of a file, what people call it) -> what it makes, or all that is wrong with it."""


def read_folders(
    folders: Iterable[tuple[Path, str]], make: "Maker[D]", taken: "Callable[[str], str | None]" = lambda _: None
) -> "tuple[dict[str, D], list[Problem]]":
    """Read all documents of some folders; what is wrong with one harms no other.

    Args:
        folders: Folders, each with the prefix of its files' names in messages; a missing one is empty.
        make: Function that converts a file.
        taken: Owners of ids that are already in use.

    Returns:
        The results, by id, and all problems.
    """
    known: dict[str, D] = {}
    problems: list[Problem] = []
    for folder, before in folders:
        paths, problem = _files(folder)
        problems += [Problem(before or folder.name, 0, problem)] if problem else []
        for path in paths:
            origin = f"{before}{path.name}"
            made = _make(path, origin, make)
            if isinstance(made, list):
                problems += [Problem(origin, error.line, error.message) for error in made]
                continue
            holder = known[made.id].origin if made.id in known else taken(made.id)
            if holder is None:
                known[made.id] = made
            else:
                line = 1 + path.read_bytes().partition(b"\nid:")[0].count(b"\n") + 1
                problems.append(Problem(origin, line, f"`id`: {made.id} is taken by {holder}; choose another"))
    return known, problems


def _files(folder: Path) -> tuple[list[Path], str]:
    """Return the documents in a folder, and what is wrong with it."""
    try:
        found = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".md" and path.is_file())
    except FileNotFoundError:
        return [], ""
    except OSError as error:
        return [], f"the folder cannot be read: {error.strerror}"
    if len(found) > MOST_FILES:
        return found[:MOST_FILES], f"there are {len(found)} files, and {MOST_FILES} are read; take the others away"
    return found, ""


def _make(path: Path, origin: str, make: "Maker[D]") -> "D | list[DocumentError]":
    """Return what is made of a file, or what is wrong with it."""
    try:
        return make(read_source(path), origin)
    except DocumentError as error:
        return [error]
    except OSError as error:
        return [DocumentError(0, f"the file cannot be read: {error.strerror}")]
    except Exception as error:  # noqa: BLE001 - a file may come from anybody, and what it leads others into is open
        reason = f"reading it raises {type(error).__name__}; take out what is unusual in its head"
        return [DocumentError(0, f"nothing can be made of this file: {reason}")]


def decode(data: bytes) -> str:
    """Return the text of a file's content.

    Raises:
        DocumentError: It is none.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise DocumentError(line, "this is not UTF-8; save the file with that encoding") from None


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
        loader = LOADER(text)
        node = loader.get_single_node()
        head = _build(node, (), loader, places) if node is not None else None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 2 if error.problem_mark else 1
        remedy = "put a text that has a : or a bracket into quotes, and indent with spaces"
        raise DocumentError(line, f"the head is not YAML: {error.problem}; {remedy}") from None
    except yaml.reader.ReaderError as error:
        line = text.encode()[: error.position].count(b"\n") + 2
        raise DocumentError(line, "there is a character that YAML does not allow") from None
    if not isinstance(head, dict):
        raise DocumentError(2, "the head is made of lines such as `id: my-lesson`")
    return head


def _check_events(text: str) -> None:
    """Refuse references, tags and depth, before anything is built that could grow."""
    depth = 0
    for event in yaml.parse(text, LOADER):
        line = event.start_mark.line + 2
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise DocumentError(line, "references (& and *) are not allowed here; write the value out, or in quotes")
        if getattr(event, "tag", None):
            raise DocumentError(line, f"the tag {event.tag} is not allowed here; write the value without it")
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise DocumentError(line, f"the head is nested more than {DEEPEST} deep")


def _build(node: yaml.Node, place: Place, loader: Any, places: dict[Place, int]) -> Any:  # noqa: ANN401 - JSON
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
        raise DocumentError(node.start_mark.line + 2, f"{node.value[:40]!r} is not a value; put it in quotes") from None
    if isinstance(value, int) and abs(value) >= LARGEST_NUMBER:
        raise DocumentError(node.start_mark.line + 2, f"{node.value[:40]!r} is too large a number")
    if isinstance(value, bool) and node.value.lower() not in {"true", "false"}:
        return node.value
    if isinstance(value, str) and not node.style and EXPONENT.fullmatch(value):
        return float(value)
    return value if isinstance(value, bool | int | float | str) else node.value


def _pairs(node: yaml.MappingNode) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise DocumentError(key.start_mark.line + 2, "a key is a plain word")
        yield key.value, key, value


@dataclass
class Findings:
    """The problems so far.

    Attributes:
        document: Their document.
        problems: In the order in which they were found.
    """

    document: Document
    problems: list[DocumentError] = field(default_factory=list)

    def add(self, place: Place, message: str) -> None:
        """Note that something is wrong with a value."""
        self.problems.append(DocumentError(self.document.line(place), message))

    def attempt(self, place: Place, what: Callable[[], T]) -> T | None:
        """Return what a function gives; None if it refuses, which is noted."""
        try:
            return what()
        except RefusedError as error:
            inner = (*place, error.field)
            self.add(inner if inner in self.document.lines else place, str(error))
        return None


def ask(document: Document, model: type[M], kind: str, page: str) -> M | list[DocumentError]:
    """Return the head of a document, or all that is wrong with its form.

    Args:
        document: The file.
        model: Model of its head.
        kind: Kind of the file, "a lesson".
        page: Page of the documentation with a complete example.
    """
    try:
        return model.model_validate(document.head)
    except ValidationError as error:
        return [_to_document_error(document, each, model, kind, page) for each in errors_of(error)]


def errors_of(error: ValidationError) -> list[Any]:
    """Return what is wrong, one for each place: of a value that may be of several kinds, the first kind's."""
    found: dict[tuple[Any, ...], Any] = {}
    for each in error.errors():
        place = tuple(part for part in each["loc"] if not (isinstance(part, str) and KIND.fullmatch(part)))
        found.setdefault(place, {**each, "loc": place})
    return list(found.values())


KIND: Final = re.compile(r"(?:bool|int|float|constrained-str|tuple\[.*\]|function-.*|str)")
"""Pydantic's names for the types of a value with several types; keys never have these names."""


def _to_document_error(
    document: Document,
    error: Any,  # noqa: ANN401 - pydantic's
    model: type[BaseModel],
    kind: str,
    page: str,
) -> DocumentError:
    place = tuple(error["loc"])
    name = ".".join(map(str, place))
    line = document.line(place)
    match error["type"]:
        case "missing":
            return DocumentError(line, f"`{name}` is missing; {page} shows a whole example")
        case "extra_forbidden":
            known = _part_at(model, place[:-1]).model_fields
            return DocumentError(line, f"there is no `{name}` in {kind}; {near(str(place[-1]), known)}")
        case "string_pattern_mismatch":
            return DocumentError(
                line, f"`{name}` must begin with a letter and have lower-case letters, digits and hyphens between words"
            )
    message = error["msg"][:1].lower() + error["msg"][1:]
    return DocumentError(line, f"`{name}` does not fit: {message}, got {str(error['input'])[:40]!r}")


def _part_at(model: type[BaseModel], place: Place) -> type[BaseModel]:
    """Return the model of a part of a head."""
    for key in place:
        if isinstance(key, str) and key in model.model_fields:
            model = next(_models_in(model.model_fields[key].annotation), model)
    return model


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - of any kind
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def near(name: str, names: Iterable[str]) -> str:
    """Return what was probably meant, or all that there is, as the end of a sentence."""
    known = list(names)
    close = get_close_matches(name, known, n=1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(known) or 'none'}"
