"""A comparison in a notebook: what differs, what came of each run with its error at a glance, and what one gains."""

import math
from collections.abc import Iterable, Iterator
from html import escape
from typing import TYPE_CHECKING

from pftrack.output.displays.parts import box, row, table
from pftrack.output.displays.readings import MISSING, quantity
from pftrack.output.displays.sparkline import sparkline

if TYPE_CHECKING:
    from pftrack.runs.comparison import Comparison, Paired

__all__ = ["comparison_html"]


def comparison_html(comparison: "Comparison") -> str:
    """Return a comparison as HTML, as far as its runs have been computed."""
    names = [
        f"{_dot(colour)} {escape(name)}" for name, colour in zip(comparison.names, comparison.colours, strict=True)
    ]
    lines: list[tuple[str, Iterable[str]]] = [("", names)]
    lines += [(each.title, map(_format_value, each.values)) for each in comparison.settings]
    lines += list(_outcomes(comparison))
    rows = "".join(row(title, cells) for title, cells in lines)
    said = "".join(f"<p style='margin:4px 0'>{escape(line)}</p>" for line in _sentences(comparison))
    return box(f"Comparison of {len(names)} runs, {comparison.frames} frames", f"{table(rows)}<div>{said}</div>")


def _outcomes(comparison: "Comparison") -> Iterator[tuple[str, Iterable[str]]]:
    unit, outcomes = comparison.unit, comparison.outcomes
    errors = [row.error for rows in comparison.rows for row in rows if row.error is not None]
    most = max((error for error in errors if math.isfinite(error)), default=0.0)
    yield f"Mean error, {unit}" if unit else "Mean error", (quantity(each.mean_error, unit) for each in outcomes)
    yield "Kept", (f"{100 * each.kept:.0f} %" if math.isfinite(each.kept) else MISSING for each in outcomes)
    yield "First lost", ("never" if each.first_lost is None else f"frame {each.first_lost}" for each in outcomes)
    glances = zip(comparison.rows, comparison.colours, comparison.lost, strict=True)
    room = '<div style="width:180px;height:32px">'
    yield "Error", (f"{room}{sparkline(rows, colour, most, lost.tolist())}</div>" for rows, colour, lost in glances)


def _sentences(comparison: "Comparison") -> Iterator[str]:
    parted = comparison.first_difference
    yield "The runs are identical." if parted is None else f"They differ from frame {parted} on."
    names = comparison.names
    for each in comparison.paired:
        yield f"{each.title}, {names[each.second]} less {names[each.first]}: {_difference(each)}."


def _difference(each: "Paired") -> str:
    if not each.frames:
        return "no frame in which both are known"
    factor, unit = (1.0, each.unit) if each.name == "error" else (100.0, "points")  # of 100: a difference of shares
    numbers = (each.mean, each.low, each.high)
    mean, low, high = (f"{factor * value:+.2f}" if math.isfinite(value) else MISSING for value in numbers)
    interval = f" (95 % interval {low} to {high})" if math.isfinite(each.low) else ""
    return f"{mean} {unit}{interval} over {each.frames} frames"


def _format_value(value: str | None) -> str:
    return escape(value) if value is not None else MISSING


def _dot(colour: str) -> str:
    return f'<span style="color:{colour}">●</span>'
