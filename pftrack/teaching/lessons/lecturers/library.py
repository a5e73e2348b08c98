"""The library: lecturers' lessons out of folders and packages, and all that is wrong with files there.

Files come from the project itself, from packages that name a package of theirs in the entry point group
`pftrack.teaching.lessons`, and from folders, in this order. Whatever is wrong with one harms no other.
"""

from collections import ChainMap
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final, TypeAlias, cast

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lecturers.builder import lesson_of
from pftrack.teaching.lessons.lecturers.document import DocumentError, decode, document_of, read_source
from pftrack.teaching.lessons.lesson import Lesson

GROUP: Final = "pftrack.teaching.lessons"
SHIPPED: Final = Path(__file__).parent / "shipped"
MOST_FILES: Final = 200
"""Of a folder."""
MOST_KEPT: Final = 2 * MOST_FILES
"""Files whose lessons are kept: one takes milliseconds to make, and a server is asked for all at each request."""

Note: TypeAlias = Callable[[str, Iterable[DocumentError]], None]
"""(what people call a file, what is wrong with it)."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What is wrong with a file of a lesson, or with a package of such files.

    Attributes:
        origin: The file's name, or the package's and the file's.
        line: Where, from 1; 0 of the whole file.
        message: What is wrong and what to do, a sentence without a full stop.
    """

    origin: str
    line: int
    message: str

    @property
    def sentence(self) -> str:
        """All of it in one line."""
        return f"{self.origin}, line {self.line}: {self.message}" if self.line else f"{self.origin}: {self.message}"


@dataclass(frozen=True, slots=True)
class Library:
    """What was found.

    Attributes:
        lessons: Of the course, then of lecturers, by id; those of the course are imported when they are asked for.
        problems: What is wrong with other files.
    """

    lessons: Mapping[str, Lesson]
    problems: tuple[Problem, ...]


def read_lessons(*folders: Path) -> Library:
    """Read all lecturers' lessons.

    Args:
        folders: Where to look beside the project and packages; one that is not there holds none.
    """
    known: dict[str, Lesson] = {}
    problems: list[Problem] = []

    def note(origin: str, errors: Iterable[DocumentError]) -> None:
        problems.extend(Problem(origin, error.line, error.message) for error in errors)

    for place in (*_packages(note), *(_Place(folder, "") for folder in folders)):
        for path in _files(place, note):
            origin = f"{place.origin}{path.name}"
            found = _read(path, origin)
            if not isinstance(found, _Found):
                note(origin, found)
            elif (holder := _holder(found.lesson.id, known)) is not None:
                message = f"`id`: {found.lesson.id} is taken by {holder}; choose another"
                note(origin, [DocumentError(found.id_line, message)])
            else:
                known[found.lesson.id] = found.lesson
    course = cast("MutableMapping[str, Lesson]", LESSONS)  # what is chained behind the first is only read
    return Library(ChainMap(known, course), tuple(problems))


def read_lesson(text: str) -> Lesson:
    """Return the lesson of the text of a file, as a notebook carries it.

    Raises:
        ValueError: It is none; the sentences say why.
    """
    match _found(text.encode(), "a notebook"):
        case _Found(lesson=lesson):
            return lesson
        case problems:
            raise ValueError("; ".join(f"line {error.line}: {error.message}" for error in problems))


@dataclass(frozen=True, slots=True)
class _Place:
    """A folder of files, and what stands before their names where people are told of them."""

    folder: Path
    origin: str


@dataclass(frozen=True, slots=True)
class _Found:
    """The lesson of a file, and the line of its id."""

    lesson: Lesson
    id_line: int


def _read(path: Path, origin: str) -> _Found | Iterable[DocumentError]:
    """Return the lesson of a file, or what is wrong with it: whatever that leads to, it harms no other file."""
    try:
        return _found(read_source(path), origin)
    except DocumentError as error:
        return [error]
    except OSError as error:
        return [DocumentError(0, f"the file cannot be read: {error.strerror}")]
    except Exception as error:  # noqa: BLE001 - a file may come from anybody, and what it leads others into is open
        reason = f"reading it raises {type(error).__name__}; take out what is unusual in its head"
        return [DocumentError(0, f"no lesson can be made of this file: {reason}")]


@lru_cache(MOST_KEPT)
def _found(data: bytes, origin: str) -> _Found | tuple[DocumentError, ...]:
    """Return the lesson of a file's content, or all that is wrong with it.

    Raises:
        DocumentError: It is no text with a head.
    """
    document = document_of(decode(data))
    lesson = lesson_of(document, origin)
    return _Found(lesson, document.line(("id",))) if isinstance(lesson, Lesson) else tuple(lesson)


def _holder(lesson_id: str, known: Mapping[str, Lesson]) -> str | None:
    """Return whose lesson has an id already; None if nobody's."""
    if lesson_id in LESSONS:
        return "a lesson of the course"
    return known[lesson_id].origin if lesson_id in known else None


def _files(place: _Place, note: Note) -> list[Path]:
    try:
        found = sorted(path for path in place.folder.iterdir() if path.suffix.lower() == ".md" and path.is_file())
    except FileNotFoundError:
        return []
    except OSError as error:
        note(place.origin or place.folder.name, [DocumentError(0, f"the folder cannot be read: {error.strerror}")])
        return []
    if len(found) > MOST_FILES:
        message = f"there are {len(found)} files, and {MOST_FILES} are read; take the others away"
        note(place.origin or place.folder.name, [DocumentError(0, message)])
    return found[:MOST_FILES]


def _packages(note: Note) -> Iterator[_Place]:
    """Yield the folders of the project and of other packages, in an order that does not hang on how these are found."""
    yield _Place(SHIPPED, "pftrack: ")
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.name
        folder = _folder(entry)
        if isinstance(folder, Path):
            yield _Place(folder, f"{origin}: ")
        else:
            note(origin, [DocumentError(0, folder)])


def _folder(entry: EntryPoint) -> Path | str:
    """Return the folder of the package that an entry point names, or why there is none."""
    try:
        files = import_module(entry.module).__file__
    except (Exception, SystemExit) as error:  # noqa: BLE001 - what a foreign import may raise is open
        return f"importing {entry.module} raises {type(error).__name__}; its lessons are left out"
    if files is None:
        return f"{entry.module} has no folder; name a package that has an __init__.py and the files beside it"
    return Path(files).parent
