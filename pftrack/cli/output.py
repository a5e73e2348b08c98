"""Output of commands: the result on standard output, all else on standard error; and shared options.

With `--json` the result is exactly one JSON value, even for a failure; without it, a table for people. A command that
fails raises a `CommandError`, or passes an error of the library on: `explain` turns either into one sentence. Values of
parameters are given as NAME=VALUE, or as NAME=@FILE where the value is a file's text; `--jobs` sets the number of
processes of a command.
"""

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import is_dataclass
from difflib import get_close_matches
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer
from rich import progress as bars
from rich.console import Console
from rich.table import Table
from rich.text import Text

from pftrack.core.refusal import ParameterError, RefusedError

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Parameters, Value

Json = Annotated[bool, typer.Option("--json", help="Print one JSON value.")]
Jobs = Annotated[str | None, typer.Option(metavar="N", help="Number of worker processes (default: one per core).")]
Cluster = Annotated[
    str | None, typer.Option("--cluster", metavar="ADDRESS", help="Address of a Dask scheduler to compute on.")
]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value; may be repeated.")
]
WIDEST = 100_000  # letters of a line on a pipe, where nothing is folded
FAILED = 1
WRONG_USE = 2

Tick: TypeAlias = Callable[[float, float], None]


class CommandError(Exception):
    """A command cannot do what was asked.

    Attributes:
        message: One sentence for people.
        status: The exit status.
        details: Further values for programs.
    """

    def __init__(self, message: str, status: int = FAILED, details: Mapping[str, object] | None = None) -> None:
        super().__init__(message)
        self.message = " ".join(message.split())
        self.status = status
        self.details = dict(details or {})

    def as_dict(self) -> dict[str, object]:
        """Return the failure as `--json` shows it."""
        return {"error": {"message": self.message, **self.details}}


def wrong_use(message: str) -> CommandError:
    """Return the failure of a command that was given something impossible."""
    return CommandError(message, WRONG_USE)


@contextmanager
def refusing(kind: type[Exception] = RefusedError) -> Iterator[None]:
    """Make wrong use of what the library refuses, or of errors of another kind; each is a sentence."""
    try:
        yield
    except kind as error:
        raise wrong_use(str(error)) from None


@contextmanager
def writing(place: Path) -> Iterator[None]:
    """Report the file that cannot be written, and why."""
    try:
        yield
    except FileExistsError:
        raise CommandError(f"{place} already exists; choose another name") from None
    except OSError as error:
        raise CommandError(f"{place} cannot be written: {error.strerror or error}") from None


@contextmanager
def reading(place: Path) -> Iterator[None]:
    """Report the file that cannot be read as text, and why."""
    try:
        yield
    except OSError as error:
        raise CommandError(f"{place} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise CommandError(f"{place} is not a UTF-8 text file") from None


def suffix_of(path: Path, known: tuple[str, ...]) -> str:
    """Return the suffix of a file that is to be written, if it is one of those and the file has a folder."""
    if path.suffix.lower() not in known:
        raise wrong_use(f"expected a file {' or '.join(known)}, got {path.name!r}")
    check_writable(path)
    return path.suffix.lower()


def check_writable(*places: Path) -> None:
    """Refuse files that cannot be written, before anything is computed."""
    for place in places:
        folder = place.absolute().parent
        if place.is_dir():
            raise CommandError(f"{place} cannot be written: it is a folder")
        if not folder.is_dir():
            raise CommandError(f"{place} cannot be written: the folder {folder} does not exist")
        if not os.access(folder, os.W_OK):
            raise CommandError(f"{place} cannot be written: its folder is read-only")


def whole(option: str, text: str, low: int, high: int) -> int:
    """Read a whole number from the command line; wrong use if it is none or out of bounds."""
    try:
        value = int(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        raise wrong_use(f"{option} must be a whole number between {low} and {high}, got {text[:40]!r}")
    return value


def read_seed(text: str | None) -> int | None:
    """Read `--seed`; None if it is not given."""
    from pftrack.core.numerics.random import LARGEST_SEED

    return None if text is None else whole("--seed", text, 0, LARGEST_SEED)


def explain(error: Exception) -> CommandError:
    """Turn any error into one sentence and an exit status."""
    if hasattr(error, "format_message") and hasattr(error, "exit_code"):  # the command line's own complaints
        return CommandError(f"{error.format_message()}{_given_value(error)}", error.exit_code)
    match error:
        case CommandError():
            found = error
        case ParameterError():
            details = {"field": error.field, "bound": error.bound, "value": error.value}
            found = CommandError(str(error), WRONG_USE, details)
        case OSError(strerror=str(reason)):
            found = CommandError(f"{error.filename}: {reason}" if error.filename else reason)
        case MemoryError():
            found = CommandError("not enough memory")
        case ValueError() if _is_library_error(error):  # a refusal, already a sentence
            found = CommandError(str(error))
        case Exception() if hasattr(error, "field"):  # the same of a sweep
            found = CommandError(str(error))
        case _:
            if os.environ.get("PFTRACK_DEBUG"):
                raise error
            what = f"{type(error).__name__}: {error}"
            found = CommandError(f"internal error (a bug in pftrack): {what}; PFTRACK_DEBUG=1 shows the traceback")
    return found


def emit(value: object) -> None:
    """Print one JSON value, in ASCII for consoles of any encoding; a number outside JSON becomes null."""
    sys.stdout.write(json.dumps(_plain(value), allow_nan=False) + "\n")
    sys.stdout.flush()


def picked(value: object, *names: str) -> dict[str, Any]:
    """Return some attributes of an object by name, for JSON."""
    return {name: getattr(value, name) for name in names}


def note(message: str) -> None:
    """Print a message on standard error."""
    Console(stderr=True, highlight=False, soft_wrap=True).print(Text(message))


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table for people on standard output."""
    shown = Table(title=title or None, title_justify="left", box=None, pad_edge=False, header_style="bold")
    for column in columns:
        # A name is to be copied whole.
        shown.add_column(column, overflow="fold", no_wrap=column == "name")
    for row in rows:
        shown.add_row(*(Text(cell) for cell in row))
    Console(highlight=False, width=None if sys.stdout.isatty() else WIDEST).print(shown)


def tell(value: object, columns: Sequence[str], rows: Iterable[Sequence[object]], *, json: bool) -> None:
    """Print a result: one JSON value, or a table for people."""
    if json:
        emit(value)
    else:
        table("", columns, [[cell(each) for each in row] for row in rows])


def cell(value: object) -> str:
    """Return a value as a table shows it: numbers in four digits, and nothing for None."""
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


class _Rate(bars.ProgressColumn):
    """Finished pieces per second."""

    def render(self, task: bars.Task) -> Text:
        """Return the rate, once it is known."""
        return Text(f"{task.speed:,.1f}/s" if task.speed else "measuring")


@contextmanager
def progress(title: str, *, counted: bool = True) -> Iterator[Tick]:
    """Show the progress of a long command, on standard error if that is a terminal; yields a function (done, total).

    Args:
        title: Title of the work.
        counted: Whether to show a number of pieces, or a share.
    """
    amount = (bars.MofNCompleteColumn(), _Rate()) if counted else (bars.TaskProgressColumn(),)
    columns = bars.TextColumn("{task.description}"), bars.BarColumn(), *amount, bars.TimeRemainingColumn()
    console = Console(stderr=True)
    with bars.Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _given_value(error: Exception) -> str:
    """The value of an option that could not be read; typer's own sentence omits it."""
    listed: Sequence[dict[str, object]] = getattr(error.__cause__ or error.__context__, "errors", list)()
    return f", got {listed[0]['input']!r}" if listed and "input" in listed[0] else ""


def _is_library_error(error: Exception) -> bool:
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and str(trace.tb_frame.f_globals.get("__name__")).startswith("pftrack.")


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, bool) or value is None or isinstance(value, (str, int)):
        return value
    if hasattr(value, "item"):  # a number of NumPy's
        return _plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)


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
            hint = f"did you mean {' or '.join(near)}?" if near else "`pftrack show EXPERIMENT` lists them"
            raise wrong_use(f"there is no parameter {name!r}; {hint}")
        values[name] = value_of(model, name, text)
    return values


def value_of(model: "type[Parameters]", name: str, text: str) -> "Value":
    """Read a value; that of a parameter which is a file's text may be the file, @FILE.

    Raises:
        ParameterError: The name is unknown or the text is not a value of its kind.
    """
    from pftrack.core.model.parameters import declarations, parse

    kinds = {declaration.name: declaration.kind for declaration in declarations(model)}
    if kinds.get(name) == "file" and text.startswith("@"):
        return text_of(Path(text[1:]))
    return parse(model, name, text)


def text_of(path: Path) -> str:
    """Return the text of a file that is to be the value of a parameter."""
    from pftrack.core.files import read_text
    from pftrack.core.model.parameters import LONGEST_FILE

    text = read_text(path, 4 * LONGEST_FILE)  # a character takes at most four bytes
    if not text.strip():  # an empty value means no file
        raise CommandError(f"{path} is empty")
    return text


def read_jobs(jobs: str | None) -> int:
    """Return the given number, or else the number of cores that this process may use."""
    return _cores() if jobs is None else whole("--jobs", jobs, 1, 256)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


EVERY_S = 3.0


@contextmanager
def compiling() -> Iterator[None]:
    """Report on standard error how many functions are compiled; nothing if none is."""
    from pftrack.core.numerics.compiled import FUNCTIONS
    from pftrack.doctor.compiling import watch

    begin = time.monotonic()
    done: list[str] = []
    said = 0.0

    def on_begin(name: str) -> None:
        nonlocal said
        del name
        if not said:
            said = time.monotonic()
            note("pftrack: compiling the code needed here (once); `pftrack doctor --warm` compiles everything")

    def on_end(name: str, seconds: float) -> None:
        nonlocal said
        del seconds
        done.append(name)
        if time.monotonic() - said > EVERY_S:
            said = time.monotonic()
            note(f"pftrack: compiling, {len(done)} functions of at most {len(FUNCTIONS)}")

    with watch(on_begin, on_end):
        yield
    if done:
        note(f"pftrack: {len(done)} functions compiled in {time.monotonic() - begin:.0f} s")


def takes_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that has the options of a group in place of each parameter whose type is such a group.

    A group is a dataclass; its fields are the options, or the parameters of its method `of` that makes one.
    """
    own = [it.replace(kind=Parameter.KEYWORD_ONLY) for it in signature(command).parameters.values()]
    groups = {it.name: _maker(it.annotation) for it in own if is_dataclass(it.annotation)}
    options = {name: list(signature(make).parameters.values()) for name, make in groups.items()}
    listed = [each.replace(kind=Parameter.KEYWORD_ONLY) for it in own for each in options.get(it.name, [it])]

    @wraps(command)
    def wrapped(**given: Any) -> None:  # noqa: ANN401 - whatever the command takes
        made = {name: make(**{it.name: given.pop(it.name) for it in options[name]}) for name, make in groups.items()}
        command(**given, **made)

    wrapped.__signature__ = signature(command).replace(parameters=listed)  # type: ignore[attr-defined] # it is read from there
    wrapped.__annotations__ = {it.name: it.annotation for it in listed}
    return wrapped


def _maker(group: Any) -> Callable[..., Any]:  # noqa: ANN401 - any dataclass
    maker: Callable[..., Any] = getattr(group, "of", group)
    return maker
