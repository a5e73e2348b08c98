"""The functions of a file, trust in texts, and calls; errors name the line.

Each function gets the arguments that it names:

    start(position, frame, parameters, rng) -> states          where particles begin
    propagate(states, frame, parameters, rng) -> states        drawn from p(x_t | x_{t-1})
    propose(states, frame, parameters, rng)                    drawn from another proposal q, with the correction
        -> states, log_correction                                  log p(x_t | x_{t-1}) - log q(x_t | x_{t-1}, z_t)
    log_likelihood(states, frame, parameters) -> (N,)          log p(z_t | x_t), up to a constant
    normalise(log_weights) -> (N,), log of their sum           logarithms of weights that sum to one
    should_resample(log_weights, parameters) -> bool           whether parents are drawn in this frame
    resample(log_weights, count, parameters, rng) -> (N,)      places of the parents
    step(states, log_weights, count, frame, parameters, rng)   a whole step in place of all but the first
        -> states, log_weights[, ancestors]

For a solid, propose, log_likelihood and step may name project as well: project(states) is where each state sees the
solid's points, (F, N, 2) px. States are (N, d), of the experiment's components; log_weights (N,) logarithms of weights
that sum to one.
"""

import ast
import dataclasses
import hashlib
import io
import linecache
import math
import signal
import sys
import threading
import tokenize
import typing
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from types import FrameType, FunctionType, ModuleType, TracebackType
from typing import Any, Literal, TypeAlias, get_args, get_origin

import numpy as np
from pydantic import with_config

from pftrack.core.model.parameters import LONGEST_FILE, Value, Within, parameter
from pftrack.core.model.recipe import FILTER_HASH, Recipe
from pftrack.core.refusal import RefusedError
from pftrack.core.texts import CLOSED, Origin, read_as
from pftrack.filters.alone import named_arguments

# The parameters of a filter in a file: a dataclass with defaults, from which declarations are made.
#
#
# A field that has the name of a parameter of the experiment is that parameter. Another number without bounds gets
# bounds around its default; a comment after it is its help, and the end of its name gives its unit.


class FilterFileError(RefusedError):
    """A filter that cannot go on; the run stands where it was.

    Attributes:
        file: Name of the file.
        line: Line of the error, from 1; None where no line can be named.
        problem: The problem, a clause.
    """

    def __init__(self, file: str, line: int | None, problem: str) -> None:
        place = file if line is None else f"{file}, line {line}"
        super().__init__(f"{place}: {problem}")
        self.file = file
        self.line = line
        self.problem = problem

    def __reduce__(self) -> tuple[type["FilterFileError"], tuple[str, int | None, str]]:
        """Travel between processes whole."""
        return type(self), (self.file, self.line, self.problem)


CLASS = "Parameters"
"""Name of the dataclass in a file."""

KEY = "pftrack"

UNITS = {"px": "px", "mm": "mm", "rad": "rad", "deg": "deg", "frames": "frames", "hz": "Hz", "s": "s"}
"""Units by the end of a parameter's name."""

Kind: TypeAlias = Any
"""The type of a field: bool, int, float, or a Literal of texts."""


@dataclasses.dataclass(frozen=True, slots=True)
class Field:
    """A parameter of a file.

    Attributes:
        name: Name of the parameter.
        kind: bool, int, float, or a Literal of texts.
        default: Initial value of a run.
        within: For a number, the smallest and the largest value, and the step of its slider.
        title: Its title.
        unit: Its printed unit.
        about: One sentence of help.
    """

    name: str
    kind: Kind
    default: Value
    within: Within | None
    title: str
    unit: str
    about: str

    def declare(self, tracker: str, group: str) -> tuple[Kind, Any]:
        """Return annotation and declaration, as a model of parameters has them."""
        declared = parameter(
            self.default,
            self.title,
            self.about,
            unit=self.unit,
            within=self.within,
            group=group,
            trackers=(tracker,),
        )
        return self.kind, declared


def slider(
    default: float,
    low: float,
    high: float,
    *,
    step: float | None = None,
    unit: str | None = None,
    title: str | None = None,
    about: str | None = None,
) -> Any:  # noqa: ANN401 - what a field of a dataclass is to a type checker
    """Return a field of the dataclass `Parameters` with bounds.

    Args:
        default: The value that a run starts with.
        low: Smallest value.
        high: Largest value.
        step: The slider's step; a hundredth of the way if not given.
        unit: The printed unit; by default from the end of the name.
        title: Title of the slider; by default its name.
        about: One sentence on what it does; the comment behind the field if not given.
    """
    return dataclasses.field(
        default=default,
        metadata={KEY: {"low": low, "high": high, "step": step, "unit": unit, "title": title, "about": about}},
    )


def fields_of(found: object, file: str, text: str) -> tuple[Field, ...]:
    """Return the parameters of a file.

    Args:
        found: The file's object `Parameters`.
        file: Its name.
        text: Its content.

    Raises:
        FilterFileError: It is not a dataclass, or a field has no default or one that a slider cannot show.
    """
    lines, comments = _places(text), _comments(text)
    if not isinstance(found, type) or not dataclasses.is_dataclass(found):
        raise FilterFileError(
            file, lines.get(""), f"{CLASS} must be a dataclass: write @dataclass in the line above it"
        )
    return tuple(_field(each, file, lines.get(each.name), comments) for each in dataclasses.fields(found))


def _field(each: "dataclasses.Field[Any]", file: str, line: int | None, comments: Mapping[int, str]) -> Field:
    default, kind = each.default, _kind(each)
    if default is dataclasses.MISSING or kind is None:
        what = "needs a default" if default is dataclasses.MISSING else "must be a number, true or false, or a Literal"
        raise FilterFileError(file, line, f"the parameter {each.name} {what}, as in `{each.name}: float = 3.0`")
    said: dict[str, Any] = dict(each.metadata.get(KEY, {}))
    within = None
    if kind in {int, float}:
        if not math.isfinite(default):
            raise FilterFileError(file, line, f"the default of {each.name} must be finite, got {default!r}")
        low, high = (said["low"], said["high"]) if "low" in said else _bounds(default)
        if not low <= default <= high:
            raise FilterFileError(file, line, f"the default of {each.name} must lie between {low:g} and {high:g}")
        default, within = kind(default), (low, high, said.get("step") or _step(kind, low, high))
    title, unit = said.get("title") or _title(each.name), said.get("unit")
    return Field(
        name=each.name,
        kind=kind,
        default=default,
        within=within,
        title=title,
        unit=UNITS.get(each.name.rpartition("_")[2], "") if unit is None else unit,
        about=said.get("about") or comments.get(line or 0) or f"{title}, of {file}.",
    )


def _kind(each: "dataclasses.Field[Any]") -> Kind | None:
    """Return the type of a field: what its default is, or a choice where it is annotated so."""
    if get_origin(each.type) is Literal and all(isinstance(choice, str) for choice in get_args(each.type)):
        return each.type
    if isinstance(each.default, bool):
        return bool
    if isinstance(each.default, int) and each.type not in {float, "float"}:
        return int
    return float if isinstance(each.default, int | float) else None


def _bounds(default: float) -> tuple[float, float]:
    reach = abs(default)
    if isinstance(default, int) and not isinstance(default, bool):
        return (0, max(10 * default, 10)) if default >= 0 else (10 * default, -10 * default)
    if reach == 0:
        return -1.0, 1.0
    if 0 < default <= 1:
        return 0.0, 1.0
    return (0.0, 10 * reach) if default > 0 else (-10 * reach, 10 * reach)


def _step(kind: Kind, low: float, high: float) -> float:
    if kind is int:
        return 1.0
    return float(10 ** math.floor(math.log10((high - low) / 100))) if high > low else 1.0


def _title(name: str) -> str:
    words, _, unit = name.rpartition("_")
    text = (words if words and unit in UNITS else name).replace("_", " ").strip()
    return text[:1].upper() + text[1:] or name


def _places(text: str) -> dict[str, int]:
    """Return the line of each field of the dataclass by name, and that of the class under the empty name."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ClassDef) and node.name == CLASS:
            fields = (
                each for each in node.body if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)
            )
            return {"": node.lineno, **{each.target.id: each.lineno for each in fields}}  # type: ignore[union-attr]
    return {}


def _comments(text: str) -> dict[int, str]:
    """Return the comment after each line, as a sentence."""
    found = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and token.line[: token.start[1]].strip():
            said = token.string.lstrip("# ").strip().rstrip(".")
            if said:
                found[token.start[0]] = f"{said[:1].upper()}{said[1:]}."
    return found


# A recipe, a saved run and a link hold the text of a filter, and may come from anybody. So no such text is executed in
# a process until the owner of this machine has stated there that exactly this text is trusted. Where texts are trusted
# already, a recipe may name them by their hash alone.

_TRUSTED: dict[str, str] = {}


def digest_of(text: str) -> str:
    """Return the hash by which a text is known, a `FILTER_HASH`; that of a hash is itself."""
    return text if FILTER_HASH.fullmatch(text) else f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def trust(*texts: str) -> None:
    """Allow these texts to be executed in this process and in those that it forks."""
    _TRUSTED.update({digest_of(text): text for text in texts if not FILTER_HASH.fullmatch(text)})


def trust_filters(recipe: Recipe) -> None:
    """Allow all filters that a recipe brings to be executed."""
    for texts in recipe.filters.values():
        trust(*texts)


def is_trusted(text: str) -> bool:
    """Return whether a text, which may be named by its hash, may be executed."""
    return digest_of(text) in _TRUSTED


def text_of(text: str) -> str | None:
    """Return a trusted text, which may be named by its hash; None if it is not trusted."""
    return _TRUSTED.get(digest_of(text))


def with_texts(recipe: Recipe) -> Recipe:
    """Return a recipe that holds the texts that it names by their hashes, as far as they are trusted here."""
    filters = {name: tuple(text_of(each) or each for each in texts) for name, texts in recipe.filters.items()}
    return recipe.model_copy(update={"filters": filters}) if filters else recipe


def with_digests(recipe: Recipe) -> Recipe:
    """Return a recipe that names all texts by their hashes."""
    filters = {name: tuple(map(digest_of, texts)) for name, texts in recipe.filters.items()}
    return recipe.model_copy(update={"filters": filters}) if filters else recipe


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Hint:
    """Description of a function.

    Attributes:
        name: Name of the function.
        arguments: Those that it may name.
        returns: Its required result, with shapes.
        about: One sentence; empty if it is not documented.
        origin: The file and line where it is declared.
    """

    name: str
    arguments: tuple[str, ...]
    returns: str = ""
    about: str = ""
    origin: Origin = field(default="", compare=False, repr=False)


_DECLARED = read_as(Hint, Path(__file__).with_name("functions.yaml"), "name")

FUNCTIONS: Mapping[str, tuple[str, ...]] = {hint.name: hint.arguments for hint in _DECLARED}
"""The functions that a file may define, with the arguments that each may name."""

HINTS = tuple(hint for hint in _DECLARED if hint.about)
"""Documentation for users."""

LONGEST_STEP_S = 10.0
"""Time limit of a file for a frame, shorter than a server's patience with a silent process."""


UNTRUSTED = (
    "this run contains its own filter, which is not trusted here; read it, and if you know where it comes "
    "from, open the run with --trust, or with trust=True in Python"
)
UNKNOWN = "this run was made with a version of the file that is not here"


class _TimeoutError(Exception):
    """A frame took too long."""


@dataclass(frozen=True, slots=True)
class FilterFile:
    """A file with a filter, as a recipe holds it.

    Attributes:
        name: Name of the tracker: the file's name without its suffix.
        text: Its content, or the hash of one that is trusted.
    """

    name: str
    text: str

    def load(self) -> "FilterCode":
        """Return what it offers; it is executed once in a process.

        Raises:
            FilterFileError: It cannot be executed, defines nothing, or is not trusted here.
        """
        text = text_of(self.text)
        if text is None:
            raise FilterFileError(f"{self.name}.py", None, UNKNOWN if FILTER_HASH.fullmatch(self.text) else UNTRUSTED)
        return _load(self.name, text)


class FilterCode:
    """The content of a file.

    Attributes:
        file: Its name.
        title: The first line of its docstring; without one its name.
        functions: Those of `FUNCTIONS` that it defines, by name.
        fields: Its parameters.
    """

    def __init__(self, name: str, text: str) -> None:
        """Execute a text; see `FilterFile.load`."""
        self.file = f"{name}.py"
        if len(text) > LONGEST_FILE:
            raise FilterFileError(
                self.file, None, f"a filter has at most {LONGEST_FILE:,} characters, got {len(text):,}"
            )
        # So that a traceback shows the lines of exactly this version.
        self._source = f"<{name}.py {digest_of(text)[7:19]}>"
        linecache.cache[self._source] = (len(text), None, text.splitlines(keepends=True), self._source)
        module = ModuleType(f"pftrack_filter_{name}_{digest_of(text)[7:19]}")
        sys.modules[module.__name__] = module
        with self._telling():
            exec(compile(text, self._source, "exec"), module.__dict__)  # noqa: S102 - that is what the file is for
        said = (module.__doc__ or name).strip().partition("\n")[0].rstrip(".")
        self.title = said[:80]
        self.functions = {each: module.__dict__[each] for each in FUNCTIONS if callable(module.__dict__.get(each))}
        if not self.functions:
            raise FilterFileError(self.file, None, f"defines none of {', '.join(FUNCTIONS)}")
        self._arguments = {
            each: named_arguments(each, function, FUNCTIONS[each], self.refuse)
            for each, function in self.functions.items()
        }
        self._class = module.__dict__.get(CLASS)
        self.fields: tuple[Field, ...] = ()
        if self._class is not None:
            with self._telling():
                _resolve(self._class)
            self.fields = fields_of(self._class, self.file, text)

    def parameters(self, values: Mapping[str, Any]) -> Any:  # noqa: ANN401 - of the file's own class
        """Return an object of the file's class with the values in force; it has all of the experiment's, too."""
        own = self._class if self._class is not None else object
        named = {each.name: values[each.name] for each in self.fields}
        with self._telling():
            return _with_all(own, values)(**named)

    def line_of(self, function: str) -> int | None:
        """Return where a function begins."""
        found = self.functions.get(function)
        found = getattr(found, "py_func", found)
        return found.__code__.co_firstlineno if isinstance(found, FunctionType) else None

    def refuse(self, function: str, problem: str) -> FilterFileError:
        """Return the error of a function that has returned something wrong."""
        return FilterFileError(self.file, self.line_of(function), f"{function} {problem}")

    def call(self, function: str, **given: Any) -> Any:  # noqa: ANN401 - whatever it returns
        """Call a function with those of the arguments that it names.

        Raises:
            FilterFileError: It raised an exception; the error names the line of the file.
        """
        named = {name: given[name] for name in self._arguments[function] if given.get(name) is not None}
        with self._telling():
            return self.functions[function](**named)

    @contextmanager
    def limited(self) -> Iterator[None]:
        """Give what runs in this context no more time than a frame may take."""
        if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
            yield  # the clock can only interrupt the main thread
            return

        def stop(number: int, where: FrameType | None) -> None:
            del number, where
            raise _TimeoutError

        before = signal.signal(signal.SIGALRM, stop)
        left, _ = signal.setitimer(signal.ITIMER_REAL, LONGEST_STEP_S)
        try:
            yield
        except _TimeoutError:  # in the library, which the file has called or which compiles
            raise FilterFileError(self.file, None, f"took longer than {LONGEST_STEP_S:g} s for a frame") from None
        finally:
            signal.setitimer(signal.ITIMER_REAL, left)
            signal.signal(signal.SIGALRM, before)

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Add the line of the file to exceptions."""
        try:
            # The result is checked, and printed text does not become the result of a command.
            with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
                yield
        except FilterFileError:
            raise
        except SyntaxError as error:
            said = error.msg if "syntax" in error.msg else f"invalid syntax: {error.msg}"
            raise FilterFileError(self.file, error.lineno, said) from None
        except _TimeoutError as error:
            line = self._line_in(error.__traceback__)
            raise FilterFileError(self.file, line, f"took longer than {LONGEST_STEP_S:g} s for a frame") from None
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
                raise  # Ctrl-C, which never comes where it is ignored
            said = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            raise FilterFileError(self.file, self._line_in(error.__traceback__), said) from error

    def _line_in(self, traceback: TracebackType | None) -> int | None:
        line = None
        while traceback is not None:
            if traceback.tb_frame.f_code.co_filename == self._source:
                line = traceback.tb_lineno
            traceback = traceback.tb_next
        return line


@lru_cache(maxsize=256)
def _load(name: str, text: str) -> FilterCode:
    return FilterCode(name, text)


def _resolve(found: object) -> None:
    """Replace annotations that are texts, as `from __future__ import annotations` makes them, by what they mean."""
    if isinstance(found, type) and hasattr(found, "__dataclass_fields__"):
        hints = typing.get_type_hints(found)
        for each in fields(found):
            each.type = hints.get(each.name, each.type)


def _with_all(own: type, values: Mapping[str, Any]) -> type:
    """Return a class that finds what it lacks among the experiment's values."""

    def find(self: object, name: str) -> Any:  # noqa: ANN401 - a value of any kind
        del self
        try:
            return values[name]
        except KeyError:
            raise AttributeError(f"there is no parameter {name}") from None

    return type(CLASS, (own,), {"__getattr__": find})
