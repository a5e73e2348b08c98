"""Which share of small faults the tests catch.

`python -m tools.mutations` draws faults at random over library, server and pages, puts each into a copy of the tree,
and runs the tests of its folder and those that import its module until one fails. It writes a line of JSON for each
fault, and continues where an earlier call stopped. A fault is a changed operator, number or truth value, a condition
turned round, or a statement left out.

    python -m tools.mutations --count 200 --seed 1 --out build/mutations.jsonl
"""

import argparse
import ast
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from tools.code_lines import ROOMS, ROOT

COMPARISONS = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
ARITHMETIC = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
SCRIPT = {
    "===": "!==",
    "!==": "===",
    "<=": "<",
    ">=": ">",
    " < ": " <= ",
    " > ": " >= ",
    "&&": "||",
    "||": "&&",
    " + ": " - ",
    " - ": " + ",
    "true": "false",
    "false": "true",
}
MOST_S = 600
"""Longest time for the tests of one fault, s; a fault that makes them hang is caught."""


@dataclass(frozen=True)
class Fault:
    """A piece of a file, and what stands there instead.

    Attributes:
        file: Path from the root of the tree.
        start: Offset of the piece, in characters.
        before: The piece.
        after: Its replacement.
    """

    file: str
    start: int
    before: str
    after: str

    def applied(self, text: str) -> str:
        """Return the text of the file with the fault in it."""
        return text[: self.start] + self.after + text[self.start + len(self.before) :]


def faults_of(name: str, text: str) -> list[Fault]:
    """Return all faults that a Python or JavaScript file can have."""
    pieces = _script_pieces(text) if name.endswith(".js") else _python_pieces(text)
    return [Fault(name, start, before, after) for start, before, after in pieces]


def draw(count: int, seed: int) -> list[Fault]:
    """Draw faults, each from a file with a chance in proportion to its lines."""
    listed = subprocess.run(["git", "ls-files", "*.py", "*.js"], cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S607
    rooms = tuple(room for room in ROOMS if room != "tests/")
    names = [name for name in listed.stdout.splitlines() if name.startswith(rooms) and "/vendor/" not in name]
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names}
    weights = [text.count("\n") for text in texts.values()]
    chance = random.Random(seed)
    found: list[Fault] = []
    while len(found) < count:
        (name,) = chance.choices(names, weights)
        possible = faults_of(name, texts[name])
        if possible and (fault := chance.choice(possible)) not in found:
            found.append(fault)
    return found


def commands(fault: Fault, tree: Path) -> list[list[str]]:
    """Return the commands that may catch a fault, the quickest first."""
    pytest = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
    parts = Path(fault.file).with_suffix("").parts
    if fault.file.startswith("frontend_static/"):
        scripts = sorted(str(path) for path in (tree / "tests/pages").glob("*.test.js"))
        return [["node", "--test", *scripts], [*pytest, "tests/browser"]]
    module = ".".join(parts[1:] if parts[0] == "server" else parts).removesuffix(".__init__")
    room = Path("tests/server", *parts[2:3]) if parts[0] == "server" else Path("tests", *parts[1:2])
    if parts[:2] == ("pftrack", "experiments"):
        room /= parts[2]
    inside = room if (tree / room).is_dir() else room.parent
    pattern = re.compile(
        rf"\b{re.escape(module)}\b|\b{re.escape(module.rpartition('.')[0])} import [^\n]*\b{parts[-1]}\b"
    )
    importing = [
        str(path.relative_to(tree))
        for path in sorted((tree / "tests").rglob("test_*.py"))
        if not path.is_relative_to(tree / inside) and pattern.search(path.read_text(encoding="utf-8"))
    ]
    return [[*pytest, *importing, str(inside)]]


def try_fault(fault: Fault, tree: Path) -> str:
    """Put a fault into a copy of the tree for as long as its tests run.

    Returns:
        `caught` if a test fails, `missed` if none does, `late` if the tests have not ended in time, as after a fault
        that makes them wait for ever.
    """
    path = tree / fault.file
    text = path.read_text(encoding="utf-8")
    path.write_text(fault.applied(text), encoding="utf-8")
    around = os.environ | {"PYTHONPATH": f"{tree}{os.pathsep}{tree / 'server'}"}
    try:
        for command in commands(fault, tree):
            tried = subprocess.run(command, cwd=tree, env=around, capture_output=True, timeout=MOST_S, check=False)  # noqa: S603
            if tried.returncode:
                return "caught"
    except subprocess.TimeoutExpired:
        return "late"
    finally:
        path.write_text(text, encoding="utf-8")
    return "missed"


def main() -> None:
    """Try faults one after the other, and print what became of those in library, server and pages."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=200, help="number of faults")
    parser.add_argument("--seed", type=int, default=1, help="seed of the draw")
    parser.add_argument("--out", type=Path, required=True, help="file of results, a line of JSON for each fault")
    given = parser.parse_args()
    done = [Fault(**row["fault"]) for row in _results(given.out)]
    with tempfile.TemporaryDirectory() as folder, given.out.open("a", encoding="utf-8") as out:
        tree = Path(folder, "tree")
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(tree)], check=True)  # noqa: S603, S607
        for fault in draw(given.count, given.seed):
            if fault not in done:
                began = time.monotonic()
                row = {"fault": asdict(fault), "outcome": try_fault(fault, tree)}
                out.write(json.dumps(row | {"time_s": round(time.monotonic() - began)}) + "\n")
                out.flush()
    rows = Counter((row["fault"]["file"].partition("/")[0], row["outcome"]) for row in _results(given.out))
    for (room, outcome), count in sorted(rows.items()):
        sys.stdout.write(f"{room}: {count} {outcome}\n")


def _results(path: Path) -> Iterator[dict[str, Any]]:
    """Yield what a file of results has; nothing where there is none yet."""
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            yield json.loads(line)


class _Source:
    """The text of a Python file, in which the parser counts places by line and by bytes of UTF-8."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._rows = text.splitlines(keepends=True)
        self._starts = [0, *accumulate(map(len, self._rows))]

    def span(self, node: ast.expr) -> tuple[int, int]:
        """Return where a node starts and ends, in characters."""
        places = (node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0)
        start, end = (self._starts[line - 1] + len(self._rows[line - 1].encode()[:at].decode()) for line, at in places)
        return start, end

    def change(self, node: ast.expr, after: str) -> Iterator[tuple[int, str, str]]:
        """Replace a node; `{}` stands for its text."""
        start, end = self.span(node)
        yield start, self.text[start:end], after.format(self.text[start:end])

    def swap(self, left: ast.expr, right: ast.expr, before: str, after: str) -> Iterator[tuple[int, str, str]]:
        """Replace the operator between two nodes."""
        at = self.text.find(before, self.span(left)[1], self.span(right)[0])
        if at >= 0:
            yield at, before, after


def _python_pieces(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield start, piece and replacement for each fault of a Python file."""
    source = _Source(text)
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                yield from source.swap(left, right, *COMPARISONS[type(operator)])
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in ARITHMETIC:
                yield from source.swap(left, right, *ARITHMETIC[type(operator)])
            case ast.BoolOp(op=operator, values=[left, right, *_]):
                words = ("and", "or") if isinstance(operator, ast.And) else ("or", "and")
                yield from source.swap(left, right, *words)
            case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
                yield from source.change(test, "(not ({}))")
            case ast.Constant(value=bool() as value):
                yield from source.change(node, str(not value))
            case ast.Constant(value=int() | float()):
                yield from source.change(node, "({} + 1)")
            case ast.Expr(value=ast.Call() as call):
                yield from source.change(call, "pass")
            case _:
                pass


def _script_pieces(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield start, piece and replacement for each fault of a script, outside of comments and texts."""
    hidden = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'", re.DOTALL)
    code = hidden.sub(lambda found: " " * len(found[0]), text)
    for found in re.finditer("|".join(re.escape(each) for each in SCRIPT), code):
        yield found.start(), found[0], SCRIPT[found[0]]
    for found in re.finditer(r"(?<![\w.])\d+(?![\w.])", code):
        yield found.start(), found[0], f"({found[0]} + 1)"


if __name__ == "__main__":
    main()
