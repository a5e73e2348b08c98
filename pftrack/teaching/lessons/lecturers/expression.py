"""Expressions: the answer of a lecturer's question, written as a formula over the numbers of a run.

    mean(lost[40:])        first(error > 20)        "lost" if last(lost) >= 110 else "held"

A name is a column with one row a frame; arithmetic and comparisons work row by row, `[40:]` takes frames. A file may
come from anybody, so nothing is handed to Python's own evaluation: the text is parsed, and of its tree only the kinds
of node in `NODES` are computed, over NumPy arrays. There are no attributes, no calls but of the functions below, no
whole numbers of any length, and no array larger than `LARGEST`.
"""

import ast
import operator
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats

LONGEST: Final = 400
"""Characters."""
DEEPEST: Final = 30
"""Levels of the tree."""
LARGEST: Final = 1_000_000
"""Numbers of an array in between."""

Value: TypeAlias = "Floats | str"
Columns: TypeAlias = Mapping[str, NDArray[Any]]


class ExpressionError(ValueError):
    """What is no expression, or has no number or text as its value whatever the run; the sentence says why."""


class NoValueError(ExpressionError):
    """An expression that has no value in this run, such as the mean of nothing; in another it may have one."""


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression that was parsed.

    Attributes:
        text: As it was written.
        tree: Of nodes that are allowed.
        names: Of the columns that it uses.
    """

    text: str
    tree: ast.expr
    names: frozenset[str]

    def value(self, columns: Columns) -> float | str:
        """Compute the value.

        Args:
            columns: By name, one row a frame.

        Raises:
            NoValueError: It has none in this run.
            ExpressionError: A name is unknown, or the value is neither a number nor a text.
        """
        with np.errstate(all="ignore"):
            value = _value(self.tree, columns)
        if isinstance(value, str):
            return value
        if value.size != 1:
            raise ExpressionError(f"it comes to {value.size} numbers, not to one; take mean(...) or one frame, [-1]")
        number = float(value.ravel()[0])
        if not np.isfinite(number):
            raise NoValueError("it comes to no finite number: a value that it uses is not known in some frame")
        return number


def parse(text: str) -> Expression:
    """Read an expression.

    Raises:
        ExpressionError: It is none.
    """
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression has at most {LONGEST} characters, got {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ExpressionError(f"{text!r} is no expression; write one such as mean(error[40:])") from None
    names: set[str] = set()
    try:
        _check(tree, names, 0)
    except RecursionError:  # of what is wrong before its depth is, and cannot be quoted
        raise ExpressionError(f"it is nested more than {DEEPEST} deep") from None
    return Expression(text.strip(), tree, frozenset(names))


# ---------------------------------------------------------------- what is allowed


def _check(node: ast.AST, names: set[str], depth: int) -> None:
    """Refuse what is not allowed, and collect the names of columns."""
    if depth > DEEPEST:
        raise ExpressionError(f"it is nested more than {DEEPEST} deep")
    if isinstance(node, ast.Call):
        _check_call(node)
    elif type(node) not in NODES and type(node) not in SIGNS:
        raise ExpressionError(f"{_quote(node)} cannot be used in an expression")
    if isinstance(node, ast.Constant) and not isinstance(node.value, bool | int | float | str):
        raise ExpressionError(f"{_quote(node)} is neither a number nor a text in quotes")
    if isinstance(node, ast.Name):
        names.add(node.id)
    for part in node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node):
        if not isinstance(part, ast.expr_context):
            _check(part, names, depth + 1)


def _check_call(node: ast.Call) -> None:
    if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
        raise ExpressionError(f"{_quote(node.func)} cannot be called; there are {', '.join(FUNCTIONS)}")
    if len(node.args) != 1 or node.keywords:
        raise ExpressionError(f"{node.func.id}(...) takes one argument, got {_quote(node)}")


def _quote(node: ast.AST) -> str:
    text = ast.unparse(node) if isinstance(node, ast.expr) else type(node).__name__
    return f"`{text if len(text) <= 30 else text[:27] + '...'}`"


# ---------------------------------------------------------------- what it comes to


def _value(node: ast.AST, columns: Columns) -> Value:
    return NODES[type(node)](node, columns)


def _name(node: ast.Name, columns: Columns) -> Value:
    if node.id not in columns:
        raise ExpressionError(unknown(node.id, columns))
    return np.asarray(columns[node.id], np.float64)


def _literal(node: ast.Constant, columns: Columns) -> Value:
    del columns
    return node.value if isinstance(node.value, str) else _constant(node.value)


def _call(node: ast.Call, columns: Columns) -> Value:
    function = FUNCTIONS[node.func.id]  # type: ignore[attr-defined] # `_check_call` has seen that it is a name
    return np.asarray(function(_number(node.args[0], columns)), np.float64)


def _arithmetic(node: ast.BinOp, columns: Columns) -> Value:
    return _pair(OPERATORS[type(node.op)], _number(node.left, columns), _number(node.right, columns))


def _unary(node: ast.UnaryOp, columns: Columns) -> Value:
    value = _number(node.operand, columns)
    return np.asarray(-value) if isinstance(node.op, ast.USub) else _truth(value == 0)


def _logic(node: ast.BoolOp, columns: Columns) -> Value:
    joined = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
    found = _truth(_number(node.values[0], columns) != 0)
    for part in node.values[1:]:
        found = _pair(joined, found, _number(part, columns))
    return found


def _comparison(node: ast.Compare, columns: Columns) -> Value:
    values = [_number(part, columns) for part in (node.left, *node.comparators)]
    found = np.ones(())
    for left, op, right in zip(values, node.ops, values[1:], strict=False):
        found = _pair(np.multiply, found, _pair(COMPARISONS[type(op)], left, right))
    return found


def _choice(node: ast.IfExp, columns: Columns) -> Value:
    test = _number(node.test, columns)
    if test.size != 1:
        raise ExpressionError("`if` asks about one number; take any(...) or all(...) of several")
    return _value(node.body if test.any() else node.orelse, columns)


def _part(node: ast.Subscript, columns: Columns) -> Value:
    value, place = _number(node.value, columns), node.slice
    parts = list(place.elts) if isinstance(place, ast.Tuple) else [place]
    if len(parts) > value.ndim:
        raise ExpressionError(f"{_quote(node)} has {len(parts)} places in brackets, and its numbers have {value.ndim}")
    places = tuple(_place(part, columns) for part in parts)
    try:
        return np.asarray(value[places])
    except IndexError:
        raise NoValueError(f"`[{ast.unparse(place)}]` is beyond the {value.shape[0]} frames that there are") from None
    except ValueError:
        raise ExpressionError(f"`[{ast.unparse(place)}]` is no range of frames") from None


def _place(node: ast.expr, columns: Columns) -> Any:  # noqa: ANN401 - whatever NumPy takes
    if isinstance(node, ast.Slice):
        return slice(*(None if part is None else _whole(part, columns) for part in (node.lower, node.upper, node.step)))
    value = _number(node, columns)
    return value != 0 if value.ndim == 1 else _whole(node, columns)


def _whole(node: ast.AST, columns: Columns) -> int:
    value = _number(node, columns)
    if value.ndim or not np.isfinite(value) or abs(value) > LARGEST or value != np.floor(value):
        raise ExpressionError(f"{_quote(node)} is no number of a frame")
    return int(value)


def _out_of_place(node: ast.AST, columns: Columns) -> Value:
    del columns
    raise ExpressionError(f"{_quote(node)} stands in brackets behind a column, or nowhere")


def _number(node: ast.AST, columns: Columns) -> Floats:
    value = _value(node, columns)
    if isinstance(value, str):
        raise ExpressionError(f"{_quote(node)} is a text, where a number is expected")
    return value


def _pair(function: Callable[[Any, Any], Any], left: Floats, right: Floats) -> Floats:
    try:
        shape = np.broadcast_shapes(left.shape, right.shape)
    except ValueError:
        raise ExpressionError(f"{len(left)} frames and {len(right)} frames do not go together") from None
    if np.prod(shape, dtype=np.float64) > LARGEST:
        raise ExpressionError(f"it comes to an array of more than {LARGEST} numbers")
    return np.asarray(function(left, right), np.float64)


def unknown(name: str, names: Collection[str]) -> str:
    """Return the sentence that says that a run has no such column, and what is near to it."""
    short = sorted(known for known in names if known.removeprefix("series_") == known)
    near = get_close_matches(name, short, n=1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(short)}"
    return f"there are no numbers called {name}; {hint}"


def _constant(number: Any) -> Floats:  # noqa: ANN401 - of any kind that `_check` lets pass
    try:
        return np.asarray(float(number))
    except OverflowError:
        raise ExpressionError("a number in it is too large") from None


def _truth(value: Any) -> Floats:  # noqa: ANN401 - of NumPy's bools
    return np.asarray(value, np.float64)


# ---------------------------------------------------------------- functions and operators


def _known_values(value: Floats) -> Floats:
    """Return the numbers that are known, those of the frames in which something was measured."""
    known = value[~np.isnan(value)] if value.ndim else value.reshape(1)
    if not known.size:
        raise NoValueError("it asks for the mean or the like of no number at all")
    return known


def _first(value: Floats) -> float:
    found = np.flatnonzero(_row(value))
    return float(found[0]) if len(found) else float(len(value))


def _last(value: Floats) -> float:
    found = np.flatnonzero(_row(value))
    return float(found[-1]) if len(found) else -1.0


def _row(value: Floats) -> Bools:
    """Return where a column holds; what is not known does not."""
    if value.ndim != 1:
        _refuse("first(...), last(...) and count(...) take one number a frame, such as error > 20")
    return np.asarray((value != 0) & ~np.isnan(value))


def _refuse(words: str) -> NoReturn:
    raise ExpressionError(words)


FUNCTIONS: Final[Mapping[str, Callable[[Floats], Any]]] = {
    "abs": np.abs,
    "all": lambda value: bool((_known_values(value) != 0).all()),
    "any": lambda value: bool((_known_values(value) != 0).any()),
    "count": lambda value: np.count_nonzero(_row(value)),
    "first": _first,
    "last": _last,
    "len": lambda value: value.shape[0] if value.ndim else _refuse("len(...) takes a column"),
    "max": lambda value: _known_values(value).max(),
    "mean": lambda value: _known_values(value).mean(),
    "median": lambda value: np.median(_known_values(value)),
    "min": lambda value: _known_values(value).min(),
    "round": np.round,
    "sd": lambda value: _known_values(value).std(),
    "sqrt": np.sqrt,
    "sum": lambda value: _known_values(value).sum(),
}
"""By name. `first` and `last` give the frame, counted within what they are given, in which something holds: the length
and -1 if it never does. `count` gives in how many it holds. Numbers that are not known are left out."""

OPERATORS: Final[Mapping[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
    ast.FloorDiv: np.floor_divide,
    ast.Mod: np.mod,
    ast.Pow: np.power,
    ast.BitAnd: np.logical_and,
    ast.BitOr: np.logical_or,
}

COMPARISONS: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], Any]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}

SIGNS: Final = frozenset((*OPERATORS, *COMPARISONS, ast.USub, ast.Not, ast.Invert, ast.And, ast.Or))

NODES: Final[Mapping[type[ast.AST], Callable[[Any, Columns], Value]]] = {
    ast.Constant: _literal,
    ast.Name: _name,
    ast.Call: _call,
    ast.BinOp: _arithmetic,
    ast.UnaryOp: _unary,
    ast.BoolOp: _logic,
    ast.Compare: _comparison,
    ast.IfExp: _choice,
    ast.Subscript: _part,
    ast.Slice: _out_of_place,
    ast.Tuple: _out_of_place,
}
"""What can be computed, and by what."""
