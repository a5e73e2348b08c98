"""Shared parts of the benchmarks: a plain table, `--json` and `--smallest`."""

import argparse
import json
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Size", "arguments", "machine", "progress", "report", "single_threaded"]


def single_threaded() -> None:
    """Keep every library to one core, before any of them is imported."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")


@dataclass(frozen=True, slots=True)
class Size:
    """An amount to measure, which can be given on the command line.

    Attributes:
        usual: Default value.
        smallest: Value with `--smallest`, which only shows that everything runs; its figures are worthless.
        help: Help text, one line.
    """

    usual: float
    smallest: float
    help: str


def arguments(description: str, **sizes: Size) -> argparse.Namespace:
    """Read the command line: `--json`, `--smallest` and the sizes."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON value")
    parser.add_argument("--smallest", action="store_true", help="measure as little as possible, to check that it runs")
    for name, size in sizes.items():
        text = f"{size.help} (default {size.usual:g})"
        parser.add_argument("--" + name, type=type(size.usual), help=text)
    given = parser.parse_args()
    for name, size in sizes.items():
        if getattr(given, name) is None:
            setattr(given, name, size.smallest if given.smallest else size.usual)
    return given


def machine() -> dict[str, object]:
    """Return the machine and versions on which the figures depend."""
    return {"python": platform.python_version(), "machine": platform.machine(), "cores": os.cpu_count()}


def progress(message: str) -> None:
    """Print to standard error what is being measured."""
    print(message, file=sys.stderr, flush=True)


def report(title: str, rows: Sequence[dict[str, object]], *, as_json: bool, **facts: object) -> None:
    """Print rows of equal keys as a table, or everything as one JSON value."""
    if as_json:
        print(json.dumps({"title": title, **facts, "machine": machine(), "rows": list(rows)}))
        return
    columns = list(rows[0])
    cells = [[_cell(row[column]) for column in columns] for row in rows]
    widths = [max(len(column), *(len(row[i]) for row in cells)) for i, column in enumerate(columns)]
    print(title)
    for name, value in facts.items():
        print(f"  {name.replace('_', ' ')}: {_cell(value)}")
    for line in [columns, *cells]:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip())


def _cell(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
