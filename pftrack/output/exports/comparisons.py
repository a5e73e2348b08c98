"""Export formats of a comparison: one list, by the suffix of a file's name, like that of runs.

The table has a row for each run and frame. The JSON file holds the whole comparison, with the manifest of each run, so
it can be repeated.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pftrack.core.arrays import Bools, Floats, spans
from pftrack.core.files import csv_text, write_whole
from pftrack.core.refusal import ConflictError
from pftrack.core.version import __version__
from pftrack.output.exports.formats import FileKind, read_kinds
from pftrack.output.figures.style import explain_below, new_figure, write_title
from pftrack.runs.comparison import Comparison
from pftrack.runs.manifest import manifest_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HIGH_IN, LANE_IN = 2.8, 0.16
LINES = ("-", "--", "-.", ":")
"""They distinguish the runs without colours."""


def draw_errors(
    errors: Sequence[Floats],
    lost: Sequence[Bools],
    *,
    names: Sequence[str],
    colours: Sequence[str],
    unit: str,
    title: str,
) -> "Figure":
    """Draw the error of each run, and below that a lane a run with the frames in which its target is lost.

    Args:
        errors: Errors of each run, (L,) by frame, NaN where unknown.
        lost: Flags of each run, (L,) whether its target is lost.
        names: Names of the runs.
        colours: Colours of the runs, "#rrggbb".
        unit: Unit of the errors.
        title: The compared quantity.
    """
    lanes_in = LANE_IN * len(names)
    figure, (panel, lanes) = new_figure(HIGH_IN + lanes_in, rows=2, share="x")
    if grid := panel.get_gridspec():
        grid.set_height_ratios((HIGH_IN, lanes_in))
    described = zip(errors, lost, names, colours, LINES, strict=False)
    for place, (error, gone, name, colour, line) in enumerate(described):
        known = np.concatenate([[False], np.isfinite(error), [False]])
        alone = known[1:-1] & ~known[:-2] & ~known[2:]
        panel.plot(error, color=colour, linestyle=line, linewidth=1.3, label=name)
        panel.plot(np.flatnonzero(alone), error[alone], color=colour, linestyle="", marker=".", markersize=4)
        widths = [(first - 0.5, last - first + 1) for first, last in spans(gone)]
        lanes.broken_barh(widths, (place + 0.15, 0.7), color=colour)
    panel.set_xlim(-0.5, max(1, *map(len, errors)) - 0.5)
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel(f"error, {unit}" if unit else "error")
    write_title(panel, title)
    lanes.set_ylim(len(names), 0)
    lanes.set_yticks([])
    lanes.set_ylabel("lost", rotation=0, ha="right", va="center")
    lanes.set_xlabel("frame")
    explain_below(figure, panel, 2)
    return figure


FORMAT = "pftrack-comparison"
COLUMNS = ("run", "name", "frame", "frame_of_run", "error", "lost")
"""Columns of the table: the run's number from 1 on and its name, the frame of the comparison and of the run, the error
in the comparison's unit, and whether the target is lost, 1 or 0; unknown values are empty."""


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
        ConflictError: The kind of file is unknown, or no error can be drawn.
        OSError: The file cannot be written; what was there before is still there.
    """
    found = next((one for one in COMPARISON_FORMATS if path.name.lower().endswith(f".{one.suffix}")), None)
    if found is None:
        known = ", ".join(f".{one.suffix}" for one in COMPARISON_FORMATS)
        raise ConflictError(f"a comparison can be exported as {known}; got {path.name!r}")
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
    from pftrack.output.figures.style import SUFFIXES, encode  # noqa: PLC0415

    rows = comparison.rows
    errors = [np.array([np.nan if row.error is None else row.error for row in each]) for each in rows]
    if not any(np.isfinite(each).any() for each in errors):
        raise ConflictError("no error can be drawn: the truth of these frames is unknown")
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
"""Export formats of every comparison, in display order."""
