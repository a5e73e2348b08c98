"""What is known beside the estimates of trajectories: the search for the selected track, its scales, and the errors.

- The search: the window over the picture, and the costs of all places as a surface in a world, the higher the less a
  place costs. On a lattice there is a peak at every crossing within reach, each nearly as high as the right one; along
  a line there is a ridge. That is why a match jumps, and where to.
- The scales of noise and motion in a plane of their own: log sigma across, log tau upwards. The surface is the
  likelihood of both under Gaussian noise, of the last frames: where there are outliers its top lies at a larger sigma,
  since a Gaussian has no other way to explain them. The points are the particles of the filter that finds the scales
  itself; where there are ever fewer of them is where it has settled. The cross is what the others are given.
- How far tracks are from the truth, and how far they seem to move, of one frame and of a whole run.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import Arrows, Links, Mesh, Points, Primitive, Text, WorldDrawing
from pftrack.core.model.palette import COLOURS, VIRIDIS, Colour
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame
from pftrack.experiments.declared import read_words
from pftrack.experiments.shared.sketch import colours, dots, lines
from pftrack.experiments.trajectories.corners import CornerParameters, Corners
from pftrack.experiments.trajectories.model import TrajectoriesState, TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.scene import TrajectoriesTarget
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import log_likelihoods
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.matching import APART_PX, cost_map, cut
from pftrack.vision.rendering import projection

SHOWN_PX = 20
"""To so far from the middle costs are shown."""

HEIGHT, FLOOR = 14.0, -7.0
PIXEL, PIECE_AT, BESIDE = 0.9, 22.0, 11.0
"""Side of a pixel of a template, how far behind the costs the templates stand, and how far beside the middle."""

MARK = 1.6
NEARLY = 1.5
"""What costs up to this many times the least is nearly as good."""
MOST_PEAKS = 40

SEARCH_WORLD, SCALES_WORLD = read_words(Path(__file__).parent)["worlds"]


@dataclass(frozen=True, eq=False)
class TemplateSearch:
    """What was looked for in a frame, and what each place cost.

    Attributes:
        template: (b, b) grey levels.
        found: (b, b) grey levels at the match.
        around: (2,) pixel around which it was looked for.
        place: (2,) pixel of the match, or of the last one.
        costs: (n, n) of all places; infinite where there is none.
        reach: To how far it was looked for, px.
    """

    template: NDArray[np.uint8]
    found: NDArray[np.uint8]
    around: Ints
    place: Ints
    costs: Floats
    reach: int

    @classmethod
    def of(
        cls, corners: Corners, image_rgb: NDArray[np.uint8], selected: int, parameters: CornerParameters
    ) -> "TemplateSearch":
        """Look for a corner once more.

        Args:
            corners: After the frame.
            image_rgb: Of the frame, (height, width, 3).
            selected: Number of the corner.
            parameters: In force in the frame.
        """
        grey, template = luma(image_rgb), corners.sought[selected]
        around, place, reach = corners.around[selected], corners.places[selected], parameters.search_reach_px
        x, y = around.tolist()
        costs = cost_map(grey, template, (x, y), reach, parameters.match_cost)
        return cls(template, cut(grey, place[None], len(template))[0], around, place, costs, reach)


def in_picture(sought: TemplateSearch) -> dict[str, Primitive]:
    """Draw the window in which the corner was looked for, the template at its match, and what looks alike."""
    half = len(sought.template) / 2.0
    places = sought.around + _peaks(sought.costs)[1:] - sought.reach
    return {
        "window": _square(sought.around, sought.reach + half, COLOURS["observation"], 1.0),
        "template": _square(sought.place, half, COLOURS["prediction"], 2.0),
        "look-alikes": dots(places, COLOURS["lost"], 3.0, "search", height=1.7),
    }


def search_world(sought: TemplateSearch) -> WorldDrawing:
    """Draw the costs of all places as a surface, the best and those nearly as good, the template and what was found."""
    reach, costs = sought.reach, sought.costs
    shown = min(reach, SHOWN_PX)
    near = slice(reach - shown, reach + shown + 1)
    drawn: dict[str, Primitive] = {}
    peaks = _peaks(costs)
    if len(peaks):
        heights = _heights(costs)
        drawn["costs"] = _surface(heights[near, near], shown)
        offsets = (peaks - reach) * [1.0, -1.0]
        marks = np.column_stack([offsets, heights[peaks[:, 1], peaks[:, 0]] + 0.4]).astype(np.float32)
        inside = (np.abs(offsets) <= shown).all(axis=1)
        each = colours(len(marks), COLOURS["lost"])
        each[0] = COLOURS["prediction"]
        drawn["peaks"] = Points(marks[inside], each[inside], MARK, "search")
    pieces = {"looked for": sought.template, "found": sought.found}
    for side, (name, piece) in zip((-1, 1), pieces.items(), strict=True):
        drawn[name] = _piece(piece, side * BESIDE)
        above = np.array([side * BESIDE, PIECE_AT, FLOOR + len(piece) * PIXEL + 2.0], np.float32)
        drawn[f"{name}, name"] = Text(above, name, COLOURS["camera"], "search", "middle")
    return WorldDrawing(SEARCH_WORLD, drawn)


def empty_search_world() -> WorldDrawing:
    """Say that nothing is looked for, as in a table of tracks."""
    text = Text(np.zeros(3, np.float32), "no picture to look in", COLOURS["hidden"], "search", "middle")
    return WorldDrawing(SEARCH_WORLD, {"nothing": text})


def _peaks(costs: Floats) -> Ints:
    """Return the least cost's place (n, 2), (column, row), and after it those of others that are nearly as good."""
    side = 2 * APART_PX - 1
    lowest = cv2.erode(costs, np.ones((side, side), np.uint8))
    rows, columns = np.nonzero(np.isfinite(costs) & (costs <= lowest) & (costs <= NEARLY * costs.min()))
    order = np.argsort(costs[rows, columns], kind="stable")[:MOST_PEAKS]
    return np.column_stack([columns, rows])[order]


def _heights(costs: Floats) -> Floats:
    """Return costs as heights, the less the higher; what cannot be is on the floor."""
    finite = costs[np.isfinite(costs)]
    low, high = float(finite.min()), float(finite.max())
    shares = np.where(np.isfinite(costs), (high - costs) / max(high - low, 1e-9), 0.0)
    return np.asarray(FLOOR + HEIGHT * shares)


def _surface(heights: Floats, reach: int) -> Mesh:
    """Draw heights (n, n) as a surface, yellow where it is high."""
    side = len(heights)
    steps = np.arange(-reach, reach + 1, dtype=np.float64)
    across, down = np.meshgrid(steps, -steps)
    vertices = np.stack([across, down, heights], axis=-1).reshape(-1, 3).astype(np.float32)
    numbers = np.arange(side * side).reshape(side, side)
    corners = numbers[:-1, :-1].ravel(), numbers[:-1, 1:].ravel(), numbers[1:, 1:].ravel(), numbers[1:, :-1].ravel()
    colours = projection.viridis((heights.ravel() - FLOOR) / HEIGHT)
    return Mesh(vertices, _two_triangles(corners), colours, 1.0, "search")


def _piece(grey: NDArray[np.uint8], middle: float) -> Mesh:
    """Draw a small picture upright behind the costs, a square for each pixel."""
    size = len(grey)
    rows, columns = (each.ravel() for each in np.indices(grey.shape))
    left, top = middle + (columns - size / 2.0) * PIXEL, FLOOR + (size - rows) * PIXEL
    places = [(left, top), (left + PIXEL, top), (left + PIXEL, top - PIXEL), (left, top - PIXEL)]
    vertices = np.stack([np.stack([x, np.full(x.shape, PIECE_AT), z], axis=-1) for x, z in places], axis=1)
    first = 4 * np.arange(size * size)
    colours = np.repeat(np.repeat(grey.ravel(), 4)[:, None], 3, axis=1)
    faces = _two_triangles((first, first + 1, first + 2, first + 3))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, colours, 1.0, "search")


def _two_triangles(corners: tuple[Ints, ...]) -> NDArray[np.int32]:
    """Return the triangles of squares, given the numbers of their corners, clockwise."""
    one, two, three, four = corners
    return np.concatenate([np.stack([one, two, three], axis=1), np.stack([one, three, four], axis=1)]).astype(np.int32)


def _square(middle: Ints, half: float, colour: Colour, width: float) -> Links:
    x, y = middle.tolist()
    corners = np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])
    return lines(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), colour, width, "search", height=1.6)


MIDDLE, HALF = (0.25, -0.75), (1.25, 1.25)
"""log10 of sigma and tau in the middle, px, and how far they are shown to either side: 0.1 to 32 px, 0.01 to 3.2 px."""

STEPS = 21
SURFACE_HEIGHT, DEEPEST = 0.8, 30.0
"""Of the surface at its top, and how far below the top, in natural logarithms, its foot is."""

FRAMES = 64
MOST_POINTS = 1500
TICKS = (
    ("0.1", 0.1, 0.006),
    ("1", 1.0, 0.006),
    ("10", 10.0, 0.006),
    ("σ, px", 1.78, 0.0035),
    ("0.1", 0.06, 0.1),
    ("1", 0.07, 1.0),
    ("τ, px", 0.1, 4.5),
)
"""What stands beside the axes, and where, px."""
CROSS, POINT = 0.15, 0.1


def scales_world(state: TrajectoriesState, parameters: TrajectoriesTrackerParameters) -> WorldDrawing:
    """Draw the likelihood of the scales, the particles that have scales of their own, and the scales that are given."""
    given = np.log10([parameters.noise_variance_px2, parameters.drive_variance_px2]) / 2.0
    drawn: dict[str, Primitive] = {"axes": Arrows(_axes(), COLOURS["hidden"], 1.5, "scales")}
    for number, (text, sigma, tau) in enumerate(TICKS):
        place = np.array([*_place(np.log10([sigma, tau])), 0.0], np.float32)
        drawn[f"tick {number}"] = Text(place, text, COLOURS["camera"], "scales", "middle")
    track = state.raw[:FRAMES, state.selected][::-1] if state.raw.shape[1] else np.zeros((0, 2))
    if np.isfinite(track).all(axis=1).sum() > 2:
        drawn["likelihood"] = _likelihood_surface(np.ascontiguousarray(track), float(parameters.start_spread_px))
    laws = state.belief.laws(state.selected) if isinstance(state.belief, Cloud) else None
    if laws is None:
        drawn["given"] = Links(_cross(_place(given)), COLOURS["estimate"], 2.5, "scales")
    else:
        logs, shares = laws
        order = np.argsort(-shares, kind="stable")[:MOST_POINTS]
        places = _place(logs[order] / (2.0 * np.log(10.0)))
        inside = places[(np.abs(places) <= HALF).all(axis=1)]
        raised = SURFACE_HEIGHT + 0.05
        drawn["particles of the scales"] = dots(inside, COLOURS["prediction"], POINT, "scales", height=raised)
    return WorldDrawing(SCALES_WORLD, drawn)


def _place(logs: Floats) -> Floats:
    """Return where log10 of sigma and tau (..., 2) are in the world."""
    return np.asarray(logs) - MIDDLE


def _axes() -> NDArray[np.float32]:
    across, up = HALF
    corner = (-across, -up, 0.0)
    return np.array([[corner, (across, -up, 0.0)], [corner, (-across, up, 0.0)]], np.float32)


def _cross(place: Floats) -> NDArray[np.float32]:
    inside = np.clip(place, [-HALF[0], -HALF[1]], HALF)
    arms = CROSS * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    flat = inside + arms
    return np.concatenate([flat, np.full((2, 2, 1), SURFACE_HEIGHT + 0.05)], axis=2).astype(np.float32)


def _likelihood_surface(track: Floats, start_sd: float) -> Mesh:
    """Draw the likelihood of a track (T, 2) over the plane, the higher and lighter the likelier."""
    across, up = (np.linspace(-half, half, STEPS) for half in HALF)
    x, y = (values.ravel() for values in np.meshgrid(across, up, indexing="ij"))
    noise, drive = (10.0 ** (2.0 * (values + middle)) for values, middle in zip((x, y), MIDDLE, strict=True))
    logs = log_likelihoods(track, noise, drive, start_sd)
    shares = np.clip(1.0 + (logs - logs.max()) / DEEPEST, 0.0, 1.0)
    vertices = np.column_stack([x, y, SURFACE_HEIGHT * shares]).astype(np.float32)
    colours = np.array(VIRIDIS, np.uint8)[np.rint(shares * (len(VIRIDIS) - 1)).astype(np.int64)]
    return Mesh(vertices, _faces(), colours, 0.85, "scales")


def _faces() -> NDArray[np.int32]:
    first = (np.arange(STEPS - 1)[:, None] * STEPS + np.arange(STEPS - 1)).ravel()
    corners = np.stack([first, first + 1, first + STEPS, first + STEPS, first + 1, first + STEPS + 1], axis=1)
    return corners.reshape(-1, 3).astype(np.int32)


def true_positions(target: object, state: TrajectoriesState, index: int) -> Floats | None:
    """Return where the tracked points truly are in a frame (K, 2), px; None where nothing is known of it."""
    if not isinstance(target, TrajectoriesTarget) or target.motion is None:
        return None
    points = state.first
    if target.start_px is not None:
        points = np.where((state.born == 0)[:, None], target.start_px, points)
    return target.motion.path(points, index, state.born)


def measure(frame: Frame, state: TrajectoriesState) -> Mapping[str, SeriesValue]:
    """Return the values of the series; those that need the truth are left out where it is not known."""
    before = frame.index - state.reach
    values: dict[str, SeriesValue] = {"smoothed_frame": float(before)}
    now, then = (true_positions(frame.target, state, index) for index in (frame.index, before))
    if now is None or then is None:
        return values | _false_motion(state)
    raw, smoothed = state.raw[0] - now, state.smoothed[state.reach] - then
    found = {
        "raw_rms_px": _rms(raw),
        "filtered_rms_px": _rms(state.filtered[0] - now),
        "smoothed_rms_px": _rms(smoothed),
        "mismatch_share": _far(raw, state.outlier_px),
        "smoothed_mismatch_share": _far(smoothed, state.outlier_px),
    }
    return values | {name: value for name, value in found.items() if math.isfinite(value)}


def _false_motion(state: TrajectoriesState) -> dict[str, SeriesValue]:
    """Return how far tracks seem to be from where they began: of those at rest, if pictures tell which those are."""
    corners = state.corners
    resting = np.ones(len(state.first), np.bool_) if corners is None else corners.resting
    moved = {
        "raw_motion_px": _rms((state.raw[0] - state.first)[resting]),
        "false_motion_px": _rms((state.smoothed[state.reach] - state.first)[resting]),
    }
    values: dict[str, SeriesValue] = {name: value for name, value in moved.items() if math.isfinite(value)}
    return values if corners is None else values | {"resting": float(resting.sum())}


def _rms(off: Floats) -> float:
    """Return the root mean square length of vectors (K, 2), of those that are known."""
    squares = np.square(off).sum(axis=1)
    known = squares[np.isfinite(squares)]
    return float(np.sqrt(known.mean())) if len(known) else math.nan


def _far(off: Floats, limit_px: float) -> float:
    """Return the share of vectors (K, 2) that are longer than a limit, of those that are known."""
    lengths = np.hypot(off[:, 0], off[:, 1])
    known = lengths[np.isfinite(lengths)]
    return float((known > limit_px).mean()) if len(known) else math.nan


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Return how many tracks there were, how far they seemed to move, and their errors where the truth is known.

    A frame's smoothed positions are those by the last frame that has smoothed it, so those of the last frames, whose
    lag is not full yet, do not count.
    """
    settled = {int(row.number("smoothed_frame")): row for row in rows}
    kinds = {
        "raw_motion_px": rows,
        "false_motion_px": settled.values(),
        "raw_rms_px": rows,
        "filtered_rms_px": rows,
        "smoothed_rms_px": settled.values(),
    }
    found = {name: _whole([row.number(name) for row in some]) for name, some in kinds.items()}
    tracks = max((row.number("tracks") for row in rows), default=0.0)
    known = {name: value for name, value in found.items() if value is not None or name == "false_motion_px"}
    return {"tracks": int(tracks), **known}


def _whole(values: Sequence[float]) -> float | None:
    known = [value * value for value in values if math.isfinite(value)]
    return math.sqrt(sum(known) / len(known)) if known else None
