"""Trajectories in the picture, through time and in two worlds, and tables of them for other programs.

Measured, filtered, smoothed and true points are drawn, outliers, and the selected track. A table has filtered and
smoothed positions, in the unit of their file. Two worlds show the selected track:

- The search: the window over the picture, and a surface over all places in a world, higher for lower costs. On a
  lattice there is a peak at every crossing within reach, each nearly as high as the right one; along a line there is a
  ridge. This shows why a match jumps, and its target.
- The scales of noise and motion in a separate plane: log sigma across, log tau upwards. The surface is the likelihood
  of both under Gaussian noise, of the last frames: where there are outliers its top lies at a larger sigma, since a
  Gaussian has no other way to explain them. The points are the particles of the filter that estimates the scales; they
  contract where it has settled. The cross shows the scales given to the other filters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.files import csv_text
from pftrack.core.model import drawing
from pftrack.core.model.setup import Export
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments.declared import read_worlds
from pftrack.experiments.shared.sketch import at_height, behind, circle, colours, dots, grid_faces, lines
from pftrack.experiments.trajectories.corners import CornerParameters, Corners
from pftrack.experiments.trajectories.model import TrajectoriesState, TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.scene import TrajectoriesTarget
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import log_likelihoods
from pftrack.vision import rendering
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.matching import APART_PX, cost_map, cut


def true_positions(target: object, state: TrajectoriesState, index: int) -> Floats | None:
    """Return where the tracked points truly are in a frame (K, 2), px; None where nothing is known of it."""
    if not isinstance(target, TrajectoriesTarget) or target.motion is None:
        return None
    points = state.first
    if target.start_px is not None:
        points = np.where((state.born == 0)[:, None], target.start_px, points)
    return target.motion.path(points, index, state.born)


TRAIL_FRAMES = 60
ON_PICTURE, OUTLIERS_ON_PICTURE = 12, 3
"""Frames of a trail, and of outliers, where there is a picture beneath that is to be seen."""

TRUE_FRAMES = 26
"""Number of true positions shown with the smoothed ones; each is computed by the scene."""

MOST_DRAWN = 2500
DOT_PX, PARTICLE_PX, RING_PX = 4.0, 2.5, 9.0
FURTHEST = 4.0
"""Distance from the picture's corner, in longer sides, beyond which nothing is drawn."""


def trails(state: TrajectoriesState, longest: float) -> dict[str, drawing.Primitive]:
    """Draw the last frames of all tracks, flat and through time, and the measurements that are outliers.

    Args:
        state: State of the frame.
        longest: Longer side of the picture, px.
    """
    raw, filtered, smoothed = (
        _near(rows[:TRAIL_FRAMES], longest) for rows in (state.raw, state.filtered, state.smoothed)
    )
    bare = state.corners is None
    flat, few = (TRAIL_FRAMES, TRAIL_FRAMES) if bare else (ON_PICTURE, OUTLIERS_ON_PICTURE)
    ends = np.stack([smoothed, raw], axis=2)
    wrong = state.outliers[:TRAIL_FRAMES] & np.isfinite(ends).all(axis=(2, 3))
    astray = ends[:few][wrong[:few]]
    depth = float(behind(np.array(1.0), longest))
    ages = np.nonzero(wrong)[0][:, None].astype(np.float64)
    drawn: dict[str, drawing.Primitive] = {
        "raw": drawing.Links(_join(raw[:flat], 1.0), drawing.COLOURS["observation"], 1.0, "measurements"),
        "raw points": _dots(raw[0], drawing.COLOURS["observation"], DOT_PX, "measurements"),
        "filtered": drawing.Links(_join(filtered[:flat], 1.2), drawing.COLOURS["prediction"], 1.5, "filtered"),
        "smoothed": drawing.Links(_join(smoothed[:flat], 1.4), drawing.COLOURS["estimate"], 2.0, "smoothed"),
        "outliers": lines(astray, drawing.COLOURS["lost"], 1.0, "outliers", height=1.6),
        "outlier points": _dots(astray[:, 1], drawing.COLOURS["lost"], DOT_PX + 1.0, "outliers"),
        "space-time": drawing.Links(
            _join(smoothed, 0.0, depth), drawing.COLOURS["estimate"], 2.0, "paths through time"
        ),
        "outlier space-time": lines(
            ends[wrong],
            drawing.COLOURS["lost"],
            1.5,
            "measured paths through time",
            height=depth * ages,
        ),
        "raw space-time": drawing.Links(
            _join(raw, 0.0, depth), drawing.COLOURS["observation"], 1.0, "measured paths through time"
        ),
    }
    return drawn


def true_trails(state: TrajectoriesState, target: object, index: int, longest: float) -> dict[str, drawing.Primitive]:
    """Draw where the points truly were, where that is known."""
    ages = range(min(len(state.raw), TRUE_FRAMES))
    known = [true_positions(target, state, index - age) for age in ages]
    rows = [_near(one, longest) for one in known if one is not None]
    flat = TRUE_FRAMES if state.corners is None else ON_PICTURE
    if not rows:
        return {}
    depth = float(behind(np.array(1.0), longest))
    return {
        "true": drawing.Links(_join(np.array(rows[:flat]), 1.1), drawing.COLOURS["truth"], 1.0, "true paths"),
        "true points": _dots(rows[0], drawing.COLOURS["truth"], 3.0, "truth"),
        "true space-time": drawing.Links(
            _join(np.array(rows), 0.0, depth), drawing.COLOURS["truth"], 1.0, "paths through time"
        ),
    }


def draw_selected(state: TrajectoriesState, longest: float) -> dict[str, drawing.Primitive]:
    """Draw a ring around the selected track, and its particles where it has some."""
    drawn: dict[str, drawing.Primitive] = {}
    if state.particles is not None:
        states, shares = state.particles
        # The heaviest first, so those that represent many remain.
        order = np.argsort(-shares, kind="stable")[:MOST_DRAWN]
        inside = _near(states[order], longest)
        raised = at_height(inside, 2.0 + drawing.LIFT * longest * shares[order] / shares[order[:1]])
        cloud = dots(raised[np.isfinite(raised).all(axis=1)], drawing.COLOURS["prediction"], PARTICLE_PX, "particles")
        drawn["particles"] = replace(cloud, stems=True)
    estimate = _near(state.estimate[None], longest)[0]
    if np.isfinite(estimate).all():
        drawn["estimate"] = circle(estimate, RING_PX, drawing.COLOURS["estimate"], "selected track", height=2.2)
    return drawn


def second_estimate(estimate: tuple[float, ...], longest: float) -> dict[str, drawing.Primitive]:
    """Draw where a second run has its selected track."""
    place = _near(np.array([estimate], dtype=np.float64), longest)[0]
    if not np.isfinite(place).all():
        return {}
    return {"second": circle(place, 1.6 * RING_PX, drawing.COLOURS["second"], "second run", height=2.1)}


def _near(positions: Floats, longest: float) -> Floats:
    """Return positions (..., 2), NaN where they are too far from the picture to be drawn."""
    near = (np.abs(positions) < FURTHEST * longest).all(axis=-1, keepdims=True)
    return np.where(near, positions, np.nan)


def _join(rows: Floats, height: float, lift: float = 0.0) -> NDArray[np.float32]:
    """Return the segments (n, 2, 3) between neighbouring frames of positions (W, K, 2), older frames further up."""
    ends = np.stack([rows[:-1], rows[1:]], axis=2)
    heights = np.broadcast_to(height + lift * np.arange(len(rows))[:, None], rows.shape[:2])
    known = np.isfinite(ends).all(axis=(2, 3))
    levels = np.stack([heights[:-1], heights[1:]], axis=2)[known]
    return at_height(ends[known], levels)


def _dots(positions: Floats, colour: drawing.Colour, size: float, layer: str, *, height: float = 1.8) -> drawing.Points:
    return dots(positions[np.isfinite(positions).all(axis=1)], colour, size, layer, height=height)


HEADER = "frame", "track", "x", "y", "filtered_x", "filtered_y", "smoothed_x", "smoothed_y", "outlier"


def table_of(state: TrajectoriesState, past: Sequence[Diagnostics]) -> bytes:
    """Return all tracks up to a frame as CSV; what was not measured has empty cells.

    Args:
        state: State of the frame.
        past: History of all frames from 0 on.
    """
    origin = state.origin
    scale = 1.0 if origin is None else origin.scale
    corner = np.zeros(2) if origin is None else origin.corner
    rows, outliers = state.history
    first = past[-1].frame + 1 - len(rows) + (0 if origin is None else origin.first_frame)
    names = [str(number) for number in range(rows.shape[1])] if origin is None else origin.names
    places = rows / scale + corner
    lines: list[tuple[str, ...]] = [HEADER]
    for frame in range(len(rows)):
        for track, name in enumerate(names):
            if np.isfinite(places[frame, track]).any():
                cells = (_cell(number) for number in places[frame, track].ravel())
                lines.append((str(first + frame), name, *cells, str(int(outliers[frame, track]))))
    return csv_text(lines).encode()


def _cell(number: np.float64) -> str:
    return f"{number:.10g}" if np.isfinite(number) else ""


EXPORTS = (Export("paths", "Trajectories up to here, CSV", "paths.csv", "text/csv", table_of),)


SHOWN_PX = 20
"""To so far from the middle costs are shown."""

HEIGHT, FLOOR = 14.0, -7.0
PIXEL, PIECE_AT, BESIDE = 0.9, 22.0, 11.0
"""Side of a template's pixel, and distances of the templates behind the costs and beside the middle."""

MARK = 1.6
NEARLY = 1.5
"""Multiple of the least cost up to which a place is nearly as good."""
MOST_PEAKS = 40

SEARCH_WORLD, SCALES_WORLD = read_worlds(Path(__file__).parent)


@dataclass(frozen=True, eq=False)
class TemplateSearch:
    """The search in a frame, and the cost of each place.

    Attributes:
        template: (b, b) grey levels.
        found: (b, b) grey levels at the match.
        around: (2,) pixel around which it was searched.
        place: (2,) pixel of the match, or of the last one.
        costs: (n, n) of all places; infinite where there is none.
        reach: Reach of the search, px.
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
            image_rgb: Picture of the frame, (height, width, 3).
            selected: Number of the corner.
            parameters: In force in the frame.
        """
        grey, template = luma(image_rgb), corners.sought[selected]
        around, place, reach = corners.around[selected], corners.places[selected], parameters.search_reach_px
        x, y = around.tolist()
        costs = cost_map(grey, template, (x, y), reach, parameters.match_cost)
        return cls(template, cut(grey, place[None], len(template))[0], around, place, costs, reach)


def in_picture(sought: TemplateSearch) -> dict[str, drawing.Primitive]:
    """Draw the window of the search, the template at its match, and similar places."""
    half = len(sought.template) / 2.0
    places = sought.around + _peaks(sought.costs)[1:] - sought.reach
    return {
        "window": _square(sought.around, sought.reach + half, drawing.COLOURS["observation"], 1.0),
        "template": _square(sought.place, half, drawing.COLOURS["prediction"], 2.0),
        "look-alikes": dots(places, drawing.COLOURS["lost"], 3.0, "search", height=1.7),
    }


def search_world(sought: TemplateSearch) -> drawing.WorldDrawing:
    """Draw the costs of all places as a surface, the best and those nearly as good, the template and what was found."""
    reach, costs = sought.reach, sought.costs
    shown = min(reach, SHOWN_PX)
    near = slice(reach - shown, reach + shown + 1)
    drawn: dict[str, drawing.Primitive] = {}
    peaks = _peaks(costs)
    if len(peaks):
        heights = _heights(costs)
        drawn["costs"] = _surface(heights[near, near], shown)
        offsets = (peaks - reach) * [1.0, -1.0]
        marks = np.column_stack([offsets, heights[peaks[:, 1], peaks[:, 0]] + 0.4]).astype(np.float32)
        inside = (np.abs(offsets) <= shown).all(axis=1)
        each = colours(len(marks), drawing.COLOURS["lost"])
        each[0] = drawing.COLOURS["prediction"]
        drawn["peaks"] = drawing.Points(marks[inside], each[inside], MARK, "search")
    pieces = {"looked for": sought.template, "found": sought.found}
    for side, (name, piece) in zip((-1, 1), pieces.items(), strict=True):
        drawn[name] = _piece(piece, side * BESIDE)
        above = np.array([side * BESIDE, PIECE_AT, FLOOR + len(piece) * PIXEL + 2.0], np.float32)
        drawn[f"{name}, name"] = drawing.Text(above, name, drawing.COLOURS["camera"], "search", "middle")
    return drawing.WorldDrawing(SEARCH_WORLD, drawn)


def empty_search_world() -> drawing.WorldDrawing:
    """State that nothing is searched, as in a table of tracks."""
    text = drawing.Text(np.zeros(3, np.float32), "no picture to look in", drawing.COLOURS["hidden"], "search", "middle")
    return drawing.WorldDrawing(SEARCH_WORLD, {"nothing": text})


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


def _surface(heights: Floats, reach: int) -> drawing.Mesh:
    """Draw heights (n, n) as a surface, yellow where it is high."""
    side = len(heights)
    steps = np.arange(-reach, reach + 1, dtype=np.float64)
    across, down = np.meshgrid(steps, -steps)
    vertices = np.stack([across, down, heights], axis=-1).reshape(-1, 3).astype(np.float32)
    colours = rendering.viridis((heights.ravel() - FLOOR) / HEIGHT)
    return drawing.Mesh(vertices, grid_faces(side, side), colours, 1.0, "search")


def _piece(grey: NDArray[np.uint8], middle: float) -> drawing.Mesh:
    """Draw a small picture upright behind the costs, a square for each pixel."""
    size = len(grey)
    rows, columns = (each.ravel() for each in np.indices(grey.shape))
    left, top = middle + (columns - size / 2.0) * PIXEL, FLOOR + (size - rows) * PIXEL
    places = [(left, top), (left + PIXEL, top), (left + PIXEL, top - PIXEL), (left, top - PIXEL)]
    vertices = np.stack([np.stack([x, np.full(x.shape, PIECE_AT), z], axis=-1) for x, z in places], axis=1)
    first = 4 * np.arange(size * size)
    colours = np.repeat(np.repeat(grey.ravel(), 4)[:, None], 3, axis=1)
    faces = np.concatenate([np.stack([first, first + k, first + k + 1], axis=1) for k in (1, 2)]).astype(np.int32)
    return drawing.Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, colours, 1.0, "search")


def _square(middle: Ints, half: float, colour: drawing.Colour, width: float) -> drawing.Links:
    x, y = middle.tolist()
    corners = np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])
    return lines(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), colour, width, "search", height=1.6)


MIDDLE, HALF = (0.25, -0.75), (1.25, 1.25)
"""log10 of sigma and tau in the middle, px, and the range shown on either side: 0.1 to 32 px, 0.01 to 3.2 px."""

STEPS = 21
SURFACE_HEIGHT, DEEPEST = 0.8, 30.0
"""Height of the surface at its top, and the depth of its foot below the top, in natural logarithms."""

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
"""Labels of the axes, and their places, px."""
CROSS, POINT = 0.15, 0.1


def scales_world(state: TrajectoriesState, parameters: TrajectoriesTrackerParameters) -> drawing.WorldDrawing:
    """Draw the likelihood of the scales, the particles' own scales, and the given scales."""
    given = np.log10([parameters.noise_variance_px2, parameters.drive_variance_px2]) / 2.0
    drawn: dict[str, drawing.Primitive] = {"axes": drawing.Arrows(_axes(), drawing.COLOURS["hidden"], 1.5, "scales")}
    for number, (text, sigma, tau) in enumerate(TICKS):
        place = np.array([*_place(np.log10([sigma, tau])), 0.0], np.float32)
        drawn[f"tick {number}"] = drawing.Text(place, text, drawing.COLOURS["camera"], "scales", "middle")
    track = state.raw[:FRAMES, state.selected][::-1] if state.raw.shape[1] else np.zeros((0, 2))
    if np.isfinite(track).all(axis=1).sum() > 2:
        drawn["likelihood"] = _likelihood_surface(np.ascontiguousarray(track), float(parameters.start_spread_px))
    laws = state.belief.laws(state.selected) if isinstance(state.belief, Cloud) else None
    if laws is None:
        drawn["given"] = drawing.Links(_cross(_place(given)), drawing.COLOURS["estimate"], 2.5, "scales")
    else:
        logs, shares = laws
        order = np.argsort(-shares, kind="stable")[:MOST_POINTS]
        places = _place(logs[order] / (2.0 * np.log(10.0)))
        inside = places[(np.abs(places) <= HALF).all(axis=1)]
        raised = SURFACE_HEIGHT + 0.05
        drawn["particles of the scales"] = dots(inside, drawing.COLOURS["prediction"], POINT, "scales", height=raised)
    return drawing.WorldDrawing(SCALES_WORLD, drawn)


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


def _likelihood_surface(track: Floats, start_sd: float) -> drawing.Mesh:
    """Draw the likelihood of a track (T, 2) over the plane, the higher and lighter the likelier."""
    across, up = (np.linspace(-half, half, STEPS) for half in HALF)
    x, y = (values.ravel() for values in np.meshgrid(across, up, indexing="ij"))
    noise, drive = (10.0 ** (2.0 * (values + middle)) for values, middle in zip((x, y), MIDDLE, strict=True))
    logs = log_likelihoods(track, noise, drive, start_sd)
    shares = np.clip(1.0 + (logs - logs.max()) / DEEPEST, 0.0, 1.0)
    vertices = np.column_stack([x, y, SURFACE_HEIGHT * shares]).astype(np.float32)
    colours = np.array(drawing.VIRIDIS, np.uint8)[np.rint(shares * (len(drawing.VIRIDIS) - 1)).astype(np.int64)]
    return drawing.Mesh(vertices, grid_faces(STEPS, STEPS), colours, 0.85, "scales")
