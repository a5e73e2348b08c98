"""What the page of a run says in words, and the track beneath its scrubber."""

import math
from collections.abc import Iterator, Sequence
from html import escape

from pftrack.parameters import declarations
from pftrack.readings import quantity
from pftrack.runs.manifest import extent_of
from pftrack.runs.run import Run
from pftrack.runs.timeline import Change
from server.viewer.standalone.recording import Recording

__all__ = ["remarks", "summary", "track"]

HEIGHT = 100.0


def remarks(recording: Recording) -> Iterator[str]:
    """Yield what the scene leaves out."""
    every = recording.kept[1] - recording.kept[0] if len(recording.kept) > 1 else 1
    if every > 1:
        yield f"One of {every} frames is in the scene; the figures have all of them."
    if recording.thinned > 1:
        yield f"One of {recording.thinned} points of each large cloud is drawn."


def summary(run: Run) -> dict[str, str]:
    """Return what came of a run, by what it is."""
    made, experiment = run.summary(), run.experiment
    extent = extent_of(run)
    lines = {"frames": extent[:1].upper() + extent[1:]}
    if made.verdict.success is not None:
        lines["outcome"] = "kept" if made.verdict.success else "lost"
    if made.verdict.mean_error is not None:
        lines["mean error"] = f"{quantity(made.verdict.mean_error, experiment.unit)} {experiment.unit}".strip()
    for measure in experiment.run_measures:
        value = made.measures.get(measure.name)
        if value is not None:
            share = f"{100 * value:.0f} %", f"{quantity(value, measure.unit)} {measure.unit}".strip()
            lines[measure.title] = share[measure.how != "share"]
    footage = run.setup.footage
    if footage is not None:
        lines |= {"recording": footage.name} | ({"its SHA-256": footage.sha256} if footage.sha256 else {})
    return {**lines, "SHA-256 of the estimates": made.estimates_sha256}


def track(run: Run) -> str:
    """Return the scrubber's ground as SVG: the error, where the target is hidden or lost, and changes."""
    rows = run.diagnostics
    last = max(1, len(rows) - 1)
    bands = [*_bands("hidden", [row.hidden is True for row in rows]), *_bands("lost", [row.gone for row in rows])]
    marks = [_mark(run, change, last) for change in run.timeline.changes if 0 < change.frame <= last]
    return (
        f'<svg viewBox="0 0 {last} {HEIGHT:g}" preserveAspectRatio="none" aria-hidden="true">'
        f'<rect class="ground" width="{last}" height="{HEIGHT:g}"/>{"".join(bands)}'
        f'<path class="error" d="{_curve([row.error for row in rows])}"/>{"".join(marks)}</svg>'
    )


def _curve(values: Sequence[float | None]) -> str:
    """Return a path through values, from the bottom up, with gaps where one is not known."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    most = max(known, default=0.0) or 1.0
    path, command = [], "M"
    for at, value in enumerate(values):
        if value is not None:
            path.append(f"{command}{at},{HEIGHT * (1.0 - 0.92 * min(1.0, value / most)):.1f}")
        command = "M" if value is None else "L"
    return " ".join(path)


def _bands(name: str, flags: list[bool]) -> Iterator[str]:
    """Yield a rectangle for each stretch of frames."""
    start = None
    for at, flag in enumerate([*flags, False]):
        if flag and start is None:
            start = at
        elif not flag and start is not None:
            yield f'<rect class="{name}" x="{start - 0.5}" width="{at - start}" height="{HEIGHT:g}"/>'
            start = None


def _mark(run: Run, change: Change, last: int) -> str:
    """Return the mark of a change, which a pointer explains."""
    titles = {item.name: item.title for item in declarations(type(run.setup.parameters))}
    said = ", ".join(f"{titles.get(name, name)} {value}" for name, value in change.values.items())
    place = f'x="{change.frame - 0.002 * last}" width="{0.004 * last}" height="14"'
    return f'<rect class="change" {place}><title>{escape(said)}</title></rect>'
