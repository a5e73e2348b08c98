"""What the benchmarks share: a plain table, and `--json`."""

import argparse
import json
import os
import platform
import sys
from collections.abc import Sequence

__all__ = ["arguments", "machine", "progress", "report", "single_threaded"]


def single_threaded() -> None:
    """Keep every library to one core, before any of them is imported."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def arguments(description: str, **options: dict[str, object]) -> argparse.Namespace:
    """Read the command line: `--json` and the options given."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON value")
    for name, settings in options.items():
        parser.add_argument("--" + name.replace("_", "-"), **settings)  # type: ignore[arg-type]
    return parser.parse_args()


def machine() -> dict[str, object]:
    """Return what the figures depend on."""
    return {"python": platform.python_version(), "machine": platform.machine(), "cores": os.cpu_count()}


def progress(message: str) -> None:
    """Say on standard error what is being measured."""
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
