"""A run at a glance: its error over the frames without axes, where its target was hidden or lost, and what changed.

It is SVG that stretches to whatever room it is given, for notebooks and pages, light or dark.
"""

import math
from collections.abc import Iterator, Sequence
from html import escape

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.palette import COLOURS, hexadecimal
from pftrack.core.model.parameters import declarations
from pftrack.core.model.timeline import Change
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run

__all__ = ["sparkline", "track"]

HEIGHT = 100.0
ROOM_ABOVE = 0.08
"""Share of the height that the largest error leaves free."""
SHADES = {"hidden": 0.25, "lost": 0.45}
FILLS = "display:block;width:100%;height:100%;max-width:none;max-height:none"
"""Style of a picture that fills its room. The style sheets of notebooks have pictures be as high as their width asks
for: that goes before attributes, but not before this."""


def sparkline(
    rows: Sequence[Diagnostics],
    colour: str = hexadecimal(COLOURS["estimate"]),
    most: float = 0.0,
    lost: Sequence[bool] | None = None,
) -> str:
    """Return the errors of frames as SVG.

    Args:
        rows: Of the frames.
        colour: Of the line, as CSS writes it.
        most: The error that reaches the top; the largest if 0.
        lost: Whether the target is lost in each; as the rows alone say if not given.
    """
    return _svg(rows, [row.is_lost for row in rows] if lost is None else lost, colour, most, "")


def track(run: Run) -> str:
    """Return the errors of all frames that a run has computed as SVG, with a mark for each change of a parameter."""
    last = max(1, run.computed)
    marks = "".join(_mark(run, change, last) for change in run.timeline.changes if 0 < change.frame <= last)
    return _svg(run.diagnostics, find_lost_frames(run).lost.tolist(), hexadecimal(COLOURS["estimate"]), 0.0, marks)


def _svg(rows: Sequence[Diagnostics], lost: Sequence[bool], colour: str, most: float, marks: str) -> str:
    flags = {"hidden": [row.hidden is True for row in rows], "lost": lost}
    bands = "".join(band for name, known in flags.items() for band in _bands(name, known))
    line = _path([row.error for row in rows], most)
    return (
        f'<svg viewBox="0 0 {max(1, len(rows) - 1)} {HEIGHT:g}" preserveAspectRatio="none" style="{FILLS}" '
        f'aria-hidden="true">{bands}<path d="{line}" fill="none" stroke="{colour}" stroke-width="1.5" '
        f'vector-effect="non-scaling-stroke"/>{marks}</svg>'
    )


def _path(errors: Sequence[float | None], most: float) -> str:
    """Return a line from the bottom up, with gaps where an error is not known; one that is not finite is at the top."""
    known = [error for error in errors if error is not None and math.isfinite(error)]
    top = most or max(known, default=0.0) or 1.0
    steps, command = [], "M"
    for at, error in enumerate(errors):
        if error is not None:
            steps.append(f"{command}{at},{HEIGHT * (1.0 - (1.0 - ROOM_ABOVE) * min(1.0, error / top)):.1f}")
        command = "M" if error is None else "L"
    return " ".join(steps)


def _bands(name: str, flags: Sequence[bool]) -> Iterator[str]:
    """Yield a rectangle for each stretch of frames in which something holds."""
    start = None
    for at, flag in enumerate([*flags, False]):
        if flag and start is None:
            start = at
        elif not flag and start is not None:
            look = f'fill="{hexadecimal(COLOURS[name])}" opacity="{SHADES[name]}"'
            yield f'<rect x="{start - 0.5}" width="{at - start}" height="{HEIGHT:g}" {look}/>'
            start = None


def _mark(run: Run, change: Change, last: int) -> str:
    """Return the mark of a change, which a pointer explains."""
    titles = {item.name: item.title for item in declarations(type(run.setup.parameters))}
    said = ", ".join(f"{titles.get(name, name)} {value}" for name, value in change.values.items())
    place = f'x="{change.frame - 0.002 * last}" width="{0.004 * last}" height="14"'
    return f'<rect {place} fill="currentColor"><title>{escape(said)}</title></rect>'
