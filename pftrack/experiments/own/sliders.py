"""The parameters of a filter in a file: a dataclass with defaults, from which declarations are made.

    @dataclass
    class Parameters:
        sample_count: int = 800          # of the experiment itself: its slider, its value
        noise_px: float = 3.0            # how far a particle moves beyond its velocity
        memory: float = slider(0.9, 0, 1, step=0.01)

A field that has the name of a parameter of the experiment is that parameter. Of any other a number without bounds gets
some around its default, a comment behind it is its help, and the end of its name tells its unit.
"""

import ast
import dataclasses
import io
import math
import tokenize
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias, get_args, get_origin

from pftrack.core.model.parameters import Value, Within, parameter


class FilterFileError(ValueError):
    """A filter that cannot go on; the run stands where it was.

    Attributes:
        file: Name of the file.
        line: Where it shows, from 1; None where no line can be named.
        problem: What is wrong, a clause.
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
        name: Of the parameter.
        kind: bool, int, float, or a Literal of texts.
        default: What a run starts with.
        within: Of a number, the smallest and the largest value, and the step of its slider.
        title: What it is called.
        unit: As it is printed.
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
        unit: As it is printed; the end of the name tells if not given.
        title: What the slider is called; its name if not given.
        about: One sentence on what it does; the comment behind the field if not given.
    """
    return dataclasses.field(
        default=default,
        metadata={KEY: {"low": low, "high": high, "step": step, "unit": unit, "title": title, "about": about}},
    )


def fields_of(found: object, file: str, text: str) -> tuple[Field, ...]:
    """Return the parameters of a file.

    Args:
        found: What the file calls `Parameters`.
        file: Its name.
        text: Its content.

    Raises:
        FilterFileError: It is no dataclass, or a field has no default or one that no slider can have.
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
    """Return what is said behind each line, as a sentence."""
    found = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and token.line[: token.start[1]].strip():
            said = token.string.lstrip("# ").strip().rstrip(".")
            if said:
                found[token.start[0]] = f"{said[:1].upper()}{said[1:]}."
    return found
