"""What a comparison can be exported as: one list, by the suffix of a file's name, like that of runs.

The table has a row for each run and frame. The JSON file holds all that is known of the comparison, with the manifest
of each run, so that it can be made again.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pftrack.core.files import csv_text, write_whole
from pftrack.core.model.setup import ExportError
from pftrack.core.version import __version__
from pftrack.output.exports.formats import FileKind, read_kinds
from pftrack.runs.comparison import Comparison
from pftrack.runs.manifest import manifest_of

FORMAT = "pftrack-comparison"
COLUMNS = ("run", "name", "frame", "frame_of_run", "error", "lost")
"""Of the table: the run's number from 1 on and what it is called, the frame as they are compared and as the run counts,
the error in the comparison's unit, and whether the target is lost, 1 or 0; what is not known is empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonExport(FileKind):
    """A kind of file that can be made of a comparison.

    Attributes:
        make: Makes its content of a comparison whose frames have been computed.
    """

    make: Callable[[Comparison], bytes]


def export_comparison(comparison: Comparison, path: Path) -> None:
    """Write a comparison, as far as its runs have been computed, to a file of the kind that its name asks for.

    Raises:
        ExportError: There is no such kind of file, or there is nothing to draw.
        OSError: The file cannot be written; what was there before is still there.
    """
    found = next((one for one in COMPARISON_FORMATS if path.name.lower().endswith(f".{one.suffix}")), None)
    if found is None:
        known = ", ".join(f".{one.suffix}" for one in COMPARISON_FORMATS)
        raise ExportError(f"a comparison can be exported as {known}; got {path.name!r}")
    write_whole(path, found.make(comparison))


def _table(comparison: Comparison) -> bytes:
    return csv_text((COLUMNS, *_lines(comparison))).encode()


def _lines(comparison: Comparison) -> Iterator[tuple[str, ...]]:
    for number, (name, rows) in enumerate(zip(comparison.names, comparison.rows, strict=True), 1):
        for frame, row in enumerate(rows):
            error = "" if row.error is None or not math.isfinite(row.error) else repr(float(row.error))
            yield str(number), name, str(frame), str(row.frame), error, str(int(row.is_lost))


def _document(comparison: Comparison) -> bytes:
    told = {
        "format": FORMAT,
        "version": 1,
        "pftrack": __version__,
        **comparison.as_dict(),
        "runs": [manifest_of(run) for run in comparison.runs],
    }
    return f"{json.dumps(told, indent=1, ensure_ascii=False)}\n".encode()


def _picture(comparison: Comparison, form: str) -> bytes:
    from pftrack.output.figures.comparison import draw_errors  # noqa: PLC0415 - it loads matplotlib
    from pftrack.output.figures.picture import SUFFIXES, encode  # noqa: PLC0415

    rows = comparison.rows
    errors = [np.array([np.nan if row.error is None else row.error for row in each]) for each in rows]
    if not any(np.isfinite(each).any() for each in errors):
        raise ExportError("there is no error to draw: the truth of these frames is not known")
    title = " · ".join(comparison.names)
    figure = draw_errors(
        [np.where(np.isfinite(each), each, np.nan) for each in errors],
        [loss.lost for loss in comparison.losses],
        names=comparison.names,
        colours=comparison.colours,
        unit=comparison.unit,
        title=title,
    )
    return encode(figure, SUFFIXES[f".{form}"], title, {"runs": [manifest_of(run) for run in comparison.runs]})


MAKERS: Mapping[str, Callable[[Comparison], bytes]] = {
    "csv": _table,
    "png": lambda comparison: _picture(comparison, "png"),
    "svg": lambda comparison: _picture(comparison, "svg"),
    "json": _document,
}
COMPARISON_FORMATS = tuple(
    ComparisonExport(**fields, make=MAKERS[name]) for name, fields in read_kinds("comparisons.yaml").items()
)
"""What every comparison can be exported as, in the order in which it is listed."""
