"""Displays: HTML that a notebook shows for a run, a comparison, an explanation or a frame's inspection.

They are self-contained HTML and SVG, in the colours of the page that shows them, light or dark.
"""

import base64
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from markupsafe import Markup

from pftrack.analysis.counterfactuals import CAVEAT
from pftrack.analysis.diagnosis import diagnose
from pftrack.core.arrays import Floats, spans
from pftrack.core.model.band import DOUBTS
from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Drawing,
    Ellipse,
    Links,
    Picture,
    Polyline,
    Primitive,
    hexadecimal,
)
from pftrack.core.model.faults import without_faults
from pftrack.core.model.likelihood import LikelihoodMap
from pftrack.core.model.parameters import declarations
from pftrack.runs.loss import loss_words
from pftrack.runs.manifest import extent_of, title_of
from pftrack.runs.run import Run
from pftrack.vision.rendering import over, render_beside

if TYPE_CHECKING:
    from pftrack.analysis.explanation import Explanation
    from pftrack.runs.comparison import Comparison, Outcome, Paired


@cache
def _macros() -> Any:  # noqa: ANN401 - jinja's
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415 - only who looks has to wait

    folder = PackageLoader("pftrack", "output")
    made = Environment(loader=folder, autoescape=True, trim_blocks=True, undefined=StrictUndefined)
    return made.get_template("displays.jinja").module


# A number that is not known is a dash. Signals and shares are written to a thousandth, other quantities to a tenth.

MISSING = "–"
DECIMALS = {"": 3, "frames": 0}
"""Decimals of quantities, by unit; one decimal in other units."""


def quantity(value: float | None, unit: str) -> str:
    """Return a number of a unit in words, without the unit."""
    if value is None or not math.isfinite(value):
        return MISSING
    is_count = not unit and value == int(value) and abs(value) > 1.0
    words = f"{value:.{0 if is_count else DECIMALS.get(unit, 1)}f}"
    return words if float(words) else words.removeprefix("-")


def _with_unit(words: str, unit: str) -> str:
    return f"{words} {unit}" if unit and words != MISSING else words


# A run at a glance is its error over the frames without axes, where its target was hidden or lost, and what changed:
# SVG that stretches to whatever room it is given.

HEIGHT = 100.0
ROOM_ABOVE = 0.08
"""Share of the height that the largest error leaves free."""
SHADES = {"hidden": 0.25, "lost": 0.45}


def track(run: Run) -> str:
    """Return the error over the frames as SVG, with bands where the target is hidden or lost, and marks at changes."""
    rows, last = run.diagnostics, max(1, run.computed)
    flags = {"hidden": [row.hidden is True for row in rows], "lost": [row.is_lost for row in rows]}
    bands = [band for name, known in flags.items() for band in _bands(name, known)]
    titles = {item.name: item.title for item in declarations(type(run.setup.parameters))}
    marks = []
    for change in run.timeline.changes:
        if 0 < change.frame <= last:
            told = [f"{titles.get(name, name)} {value}" for name, value in change.values.items() if name != "move"]
            marks.append((change.frame, ", ".join([*told, *(it.words for it in run.timeline.moves_at(change.frame))])))
    path, colour = _path([row.error for row in rows]), hexadecimal(COLOURS["estimate"])
    return str(_macros().track(last, f"{HEIGHT:g}", bands, path, colour, marks))


def _path(errors: Sequence[float | None]) -> str:
    """Return a line from the bottom up, with gaps where an error is not known; one that is not finite is at the top."""
    known = [error for error in errors if error is not None and math.isfinite(error)]
    top = max(known, default=0.0) or 1.0
    steps, command = [], "M"
    for at, error in enumerate(errors):
        if error is not None:
            steps.append(f"{command}{at},{HEIGHT * (1.0 - (1.0 - ROOM_ABOVE) * min(1.0, error / top)):.1f}")
        command = "M" if error is None else "L"
    return " ".join(steps)


def _bands(name: str, flags: Sequence[bool]) -> Iterator[tuple[float, int, str, float]]:
    """Yield left edge, width, colour and opacity of a band for each stretch of frames with the flag."""
    for first, last in spans(flags):
        yield first - 0.5, last - first + 1, hexadecimal(COLOURS[name]), SHADES[name]


def comparison_html(comparison: "Comparison") -> str:
    """Return a comparison as HTML: what differs, what came of each run, and what one gains."""
    lines: list[tuple[str, Iterable[str]]] = [
        (each.title, [MISSING if value is None else value for value in each.values]) for each in comparison.settings
    ]
    title = f"Comparison of {len(comparison.names)} runs, {comparison.frames} frames"
    names = zip(comparison.names, comparison.colours, strict=True)
    return str(_macros().comparison(title, names, [*lines, *_outcomes(comparison)], _sentences(comparison)))


def _outcomes(comparison: "Comparison") -> Iterator[tuple[str, Iterable[str]]]:
    unit, outcomes = comparison.unit, comparison.outcomes
    yield f"Mean error, {unit}" if unit else "Mean error", (quantity(each.mean_error, unit) for each in outcomes)
    shares = [each.success_share for each in outcomes]
    yield comparison.success_title, (f"{100 * one:.0f} %" if math.isfinite(one) else MISSING for one in shares)
    yield "First lost frame", map(_first_lost, outcomes)


def _first_lost(outcome: "Outcome") -> str:
    if outcome.lost_frames is None:
        return MISSING
    return "never" if outcome.first_lost_frame is None else f"{outcome.first_lost_frame}"


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


SHOWN = 12
"""Changes that are listed; all are in `Explanation.lines`."""


def explanation_html(explanation: "Explanation") -> str:
    """Return an explanation as HTML."""
    report, more = explanation.what_if, ""
    findings = () if report is None else report.best_first[: SHOWN + 1]
    if report is not None and (left := len(report.best_first) - len(findings)):
        more = f" {left} further changes hold no more often."
    told = explanation.diagnosis, report, explanation.untried, findings, more, CAVEAT
    return str(_macros().explanation(*told))


WIDE_PX = 320
"""Width of the picture as shown; it has up to twice as many pixels."""
QUALITY = 85


def summary_lines(run: Run) -> dict[str, str]:
    """Return the results of a run so far, in words by name."""
    made, experiment, unit = run.summary(), run.experiment, run.experiment.judge.unit
    lines = {"Frames": extent_of(run)}
    if made.verdict.success is not None:
        lines["Success"] = "yes" if made.verdict.success else "no"
    if made.verdict.lost_frames is not None:
        lines["Loss"] = loss_words(made.frames, made.verdict.lost_frames, made.verdict.first_lost_frame)
    diagnosis = diagnose(run)
    if diagnosis.lost:
        lines["Why"] = diagnosis.sentence
        known = run.explained
        if known is not None and known.what_if is not None and known.diagnosis.frame == diagnosis.frame:
            lines["What if"] = known.what_if.sentence
    if made.verdict.mean_error is not None:
        lines["Mean error"] = _with_unit(quantity(made.verdict.mean_error, unit), unit)
    for measure in experiment.run_measures:
        value = made.measures.get(measure.name)
        if value is not None:
            share = measure.how == "share"
            words = f"{100 * value:.0f} %" if share else _with_unit(quantity(value, measure.unit), measure.unit)
            lines[measure.title] = words
    if made.doubts:
        lines["Error bands"] = " ".join(DOUBTS[doubt] for doubt in made.doubts)
    footage = run.setup.footage
    if footage is not None:
        lines |= {"Recording": footage.name} | ({"SHA-256 of the recording": footage.sha256} if footage.sha256 else {})
    return {**lines, "SHA-256 of the estimates": made.estimates_sha256}


def run_html(run: Run) -> str:
    """Return a run as HTML, at the frame at which it stands."""
    drawing = without_faults(run.experiment.draw(run.current, run.diagnostics))
    lines = {**summary_lines(run), "SHA-256 of the estimates": f"{run.estimates_sha256[:16]}…"}
    caption, picture = drawing.caption or f"Frame {run.position}", _picture(run, drawing)
    return str(_macros().run(title_of(run), WIDE_PX, picture, caption, lines, Markup(track(run))))  # noqa: S704 - ours


def _picture(run: Run, drawing: Drawing) -> str:
    """Return a drawing as a film would show it, as an address that holds its content."""
    scale = max(1.0, 2.0 * WIDE_PX / max(1, drawing.width * (1 + len(drawing.worlds))))
    image = render_beside(replace(drawing, caption=""), layers=run.experiment.display.shown, scale=min(2.0, scale))
    file = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return f"data:image/jpeg;base64,{base64.b64encode(file.tobytes()).decode()}"


LAYER = "inspected"
"""Layer of the inspection; it does not belong to an experiment, and is always shown."""

RING_SHARE = 0.022
"""Radius of the ring around the place, as a share of the picture's width; its cross reaches twice as far."""
SHORTEST_RING_PX = 4.0


def draw_likelihood(drawing: Drawing, found: LikelihoodMap) -> Drawing:
    """Return a drawing whose picture is grey, with a likelihood over it from purple, the lowest, to yellow.

    A viewer with depth shows it as a relief, too. Its caption names these numbers. Without a picture, the likelihood
    lies on white paper.
    """
    items, relief = drawing.primitives, found.levels.astype(np.float32)
    name = next((name for name, item in items.items() if isinstance(item, Picture)), None)
    if name is None:
        paper = np.full((drawing.height, drawing.width, 3), 255, np.uint8)
        heat = Picture(over(paper, found.levels, width=drawing.width), relief=relief)
        primitives: dict[str, Primitive] = {"likelihood": heat, **items}
    else:
        picture = items[name]
        assert isinstance(picture, Picture)  # noqa: S101 - found as one
        image = picture.image_rgb
        primitives = {**items, name: Picture(over(image, found.levels, width=image.shape[1]), picture.layer, relief)}
    low, high = found.range
    scale = f"log likelihood from {low:.3g}, purple, to {high:.3g}, yellow"
    caption = f"{drawing.caption} · {scale}" if drawing.caption else scale
    return replace(drawing, primitives=primitives, caption=caption)


def draw_arrows(drawing: Drawing, arrows: Sequence[tuple[float, float, float, float]]) -> Drawing:
    """Return a drawing with arrows, x, y, x, y px each, that show the direction of a pull."""
    ends = np.asarray(arrows, np.float32).reshape(-1, 2, 2)
    ends = ends[np.isfinite(ends).all(axis=(1, 2))]
    segments = np.concatenate([ends, np.zeros((len(ends), 2, 1), np.float32)], axis=2)
    pulls = Arrows(segments, COLOURS["inspected"], 2.0, LAYER)
    return replace(drawing, primitives={**drawing.primitives, "inspected pulls": pulls})


def draw_place(drawing: Drawing, place: Floats, path: Floats) -> Drawing:
    """Return a drawing with a ring and a cross around a place, and the way that leads there.

    Args:
        drawing: The drawing.
        place: (2,) px.
        path: (A, 2) the place and where it was in the frames before, px; empty without.
    """
    colour = COLOURS["inspected"]
    radius = max(SHORTEST_RING_PX, RING_SHARE * drawing.width)
    u, v = place
    centre = np.array([u, v, 0.0], np.float32)
    ring = Ellipse(centre, radius * np.eye(2, dtype=np.float32), colour, 2.0, LAYER)
    arms = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
    cross = np.array([[(u + r * radius * a, v + r * radius * b, 0.0) for r in (1.0, 2.0)] for a, b in arms], np.float32)
    items: dict[str, Primitive] = {"inspected ring": ring, "inspected cross": Links(cross, colour, 2.0, LAYER)}
    if len(path) > 1:
        way = np.column_stack([path, np.zeros(len(path))]).astype(np.float32)
        items["inspected path"] = Polyline(way, colour, 2.0, LAYER)
    return replace(drawing, primitives={**drawing.primitives, **items})
