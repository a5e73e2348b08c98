"""The shape of a turning rigid body, from its points' positions in each frame (Bando 2007, ch. 4 section 5).

A tracker receives tracks (positions of points with the variances of their noise) and no picture. It finds their shape
frame by frame: by singular values, for which a hidden point counts as much as a visible one; by variational Bayes,
which uses the noise of each; and by the project's own recursion.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model import drawing
from pftrack.core.model.measures import EvaluatedRun
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, Target, Truth
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.refusal import ParameterError
from pftrack.experiments.declared import read_words, read_worlds
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.shared.pose.drawing import dashes
from pftrack.experiments.shared.sketch import (
    at_height,
    before_camera,
    caption,
    circle,
    colours,
    dots,
    frustum,
    lines,
    paper,
)
from pftrack.experiments.structure.methods import StructureTrackerParameters
from pftrack.experiments.structure.scene import BodyTarget, TracksSceneParameters, TracksSource, named_body
from pftrack.experiments.structure.trackers import MIRROR, TRACKERS, StructureState
from pftrack.sources.tracks import RecordedTracks, TrackSequence
from pftrack.vision.face import fit_similarity
from pftrack.vision.structure.factorization import FEWEST_POINTS

FOLDER = Path(__file__).parent

FOUND_PERCENT = 5.0
"""Up to this shape error a shape counts as found."""

WITHIN = "shape_within_5_percent"
"""The measure by which a run is a success."""


def _within(course: EvaluatedRun) -> Floats:
    known = ~np.isnan(course.errors)
    return np.where(known, course.errors <= FOUND_PERCENT, np.nan)


(SHAPE_WORLD,) = read_worlds(FOLDER)

MOST_POINTS = 100
"""Whose common covariance is found in a frame's time."""

DEPTH_SEEN = 1.5
"""Least strength of the third direction over the noise for a shape that is not flat."""


# The points in the picture, the shape in a separate world, and its error.
#
# The error is taken up to an affine map, as in Bando, and up to a similarity. The world, whose unit is the size of the
# body, shows the believed shape, with the true one as a ghost. If the truth is known the shape is turned and moved onto
# it, but never mirrored, so a shape with inverted depth is visible as such. The camera goes round the body, which is at
# rest.

SHARE = 100.0
"""Percent of the body's size."""

ELLIPSOIDS = {"within_50": 2.366, "within_95": 7.815}
"""Squares of the half axes, in standard deviations, of ellipsoids that hold so much of a Gaussian in three numbers."""

LEAST_VARIANCE = 1e-12
"""Least standard deviation of a point in any direction, to avoid division by zero."""

FLAT = 1e-7
"""Extent in a direction, relative to the greatest, that is none."""


def shape_errors(estimates: Floats, truths: Floats) -> Floats:
    """Return the shape errors (...), % (Bando 2007, eq. 4.19), of shapes (..., 3 n): what an affine map leaves.

    The best affine map takes of the true coordinates what the estimated ones span, so the error is what they do not.
    That also holds for a flat shape, which spans less.
    """
    found = estimates.reshape(*estimates.shape[:-1], -1, 3)
    true = truths.reshape(*truths.shape[:-1], -1, 3)
    found, true = (shape - shape.mean(axis=-2, keepdims=True) for shape in (found, true))
    spanned, extents, _ = np.linalg.svd(found, full_matrices=False)
    spanned = spanned * (extents > FLAT * extents[..., :1])[..., None, :]
    rest = true - spanned @ (np.swapaxes(spanned, -1, -2) @ true)
    sizes = np.square(true).sum(axis=(-2, -1))
    shares = np.divide(np.square(rest).sum(axis=(-2, -1)), sizes, out=np.full(sizes.shape, np.nan), where=sizes > 0.0)
    return np.asarray(SHARE * np.sqrt(shares))


def true_shape(target: object) -> Floats | None:
    """Return the true shape (n, 3) of a target, where it is known."""
    if not isinstance(target, BodyTarget) or not target.position.any():
        return None
    return target.position.reshape(-1, 3)


def measure(frame: Frame, state: StructureState) -> Mapping[str, SeriesValue]:
    """Return the values of the series, where the truth is known."""
    true, target = true_shape(frame.target), frame.target
    if true is None or not isinstance(target, BodyTarget) or not state.placed.known:
        return {}
    points = state.placed.points
    lay = fit_similarity(points, true)
    apart, mirrored = (_apart(one, true) for one in (points, points * MIRROR))
    off = state.placed.camera[:, :3] @ lay.rotation.T @ target.turn.T
    return {
        "metric_error": SHARE * apart,
        "mirrored": float(mirrored < apart),
        "turn_error_deg": float(np.rad2deg(np.arccos(np.clip((np.trace(off) - 1.0) / 2.0, -1.0, 1.0)))),
        **_inside_ellipsoids(state, lay.inverse(true)),
    }


def _inside_ellipsoids(state: StructureState, true: Floats) -> Mapping[str, SeriesValue]:
    """Return which points are within their ellipsoids, given the true shape (n, 3) as it lies best on the estimate."""
    off = true - state.placed.points
    covariances = state.placed.covariances + LEAST_VARIANCE * np.eye(3)
    squares = (off * np.linalg.solve(covariances, off[:, :, None])[:, :, 0]).sum(axis=1)
    return {name: tuple((squares <= limit).astype(np.float64).tolist()) for name, limit in ELLIPSOIDS.items()}


def _apart(points: Floats, true: Floats) -> float:
    """Return what a similarity leaves of the true shape, relative to its size."""
    return float(np.sqrt(np.square(fit_similarity(points, true)(points) - true).sum() / np.square(true).sum()))


TRAIL_FRAMES = 15
NEAREST = 1e-3
DOT_PX, RING_PX = 4.0, 7.0
SIGMAS = 2.0
FURTHEST = 5.0
"""Distance from the picture's corner, in its heights, beyond which nothing is drawn."""

WIDEST = 0.15
"""Half axis of an ellipse of uncertainty, as a share of the picture's height; a larger one is not informative."""


def draw_measurements(state: StructureState, height: float) -> dict[str, drawing.Primitive]:
    """Draw where the points were, where they are and how sure that is; of what is hardly seen a ring at the shape's."""
    seen, names = state.seen, state.body.names
    positions = seen.filled[-TRAIL_FRAMES:] + state.principal_px
    deviations = np.sqrt(seen.variances[-TRAIL_FRAMES:])
    sure = (SIGMAS * deviations.max(axis=2) < WIDEST * height) & _near(positions, height)
    ways = np.stack([positions[:-1], positions[1:]], axis=2)[sure[1:] & sure[:-1]]
    drawn: dict[str, drawing.Primitive] = {"trails": lines(ways, drawing.COLOURS["hidden"], 1.0, "trails")}
    drawn["points"] = dots(positions[-1][sure[-1]], drawing.COLOURS["observation"], DOT_PX, "points")
    believed = _estimated_points(state)[:, :2]
    shown = sure[-1] | _near(believed, height)
    for number in np.flatnonzero(shown):
        if sure[-1, number]:
            half_axes = (SIGMAS * np.diag(deviations[-1, number])).astype(np.float32)
            centre = at_height(positions[-1, number], 1.0)
            drawn[f"noise {names[number]}"] = drawing.Ellipse(
                centre, half_axes, drawing.COLOURS["observation"], 1.0, "noise"
            )
        else:
            ring = circle(believed[number], RING_PX, drawing.COLOURS["hidden"], "points", height=2.0)
            drawn[f"hidden {names[number]}"] = ring
    return drawn


def _near(positions: Floats, height: float) -> Bools:
    """Return which positions (..., 2) are near enough to the picture to be drawn."""
    return np.asarray((np.abs(positions) < FURTHEST * height).all(axis=-1))


def _estimated_points(state: StructureState) -> Floats:
    """Return where the shape has the points, and how high above the picture, (n, 3) px."""
    return _project(state, state.placed.points)


def _project(state: StructureState, points: Floats) -> Floats:
    """Return where points (n, 3) in the shape's frame are seen, and how high above the picture they are, (n, 3) px."""
    camera = state.placed.camera
    return _seen(points @ camera[:, :3].T + camera[:, 3], state.focal_px, state.principal_px)


def _seen(inside: Floats, focal_px: float, principal_px: Floats) -> Floats:
    """Return where points (n, 3) in a camera's frame are seen, and how high above the picture they are, (n, 3) px."""
    middle = inside.mean(axis=0)
    radius = float(np.linalg.norm(inside - middle, axis=1).max())
    inside = np.column_stack([inside[:, :2], np.maximum(inside[:, 2], NEAREST)])
    heights = before_camera(inside[:, 2], focal_px, max(float(middle[2]), NEAREST), radius)
    return np.column_stack([pinhole(inside, focal_px) + principal_px, heights])


def shape_in_picture(state: StructureState, height: float) -> dict[str, drawing.Primitive]:
    """Draw the believed shape in the picture: its points, and the edges between them."""
    return _body("shape", _estimated_points(state), state.body.edges, drawing.COLOURS["estimate"], 2.0, "shape", height)


def second_in_picture(state: StructureState, points: Floats, height: float) -> dict[str, drawing.Primitive]:
    """Draw the shape (n, 3) of a second run, laid on this one's and seen by its camera."""
    places = _project(state, fit_similarity(points, state.placed.points)(points))
    return _body("second", places, state.body.edges, drawing.COLOURS["second"], 1.5, "second run", height)


def true_in_picture(target: BodyTarget, height: float) -> dict[str, drawing.Primitive]:
    """Draw the body as it truly is seen, what is hidden dashed."""
    marks = target.landmarks
    if marks is None:
        return {}
    edges = target.shape.edges
    shown = marks.visible[edges].all(axis=1)
    inside = target.position.reshape(-1, 3) @ target.turn.T + target.translation
    places = _seen(inside, target.focal_px, target.principal_px)
    places[:, :2] = marks.points_px
    drawn = _body("true", places, edges[shown], drawing.COLOURS["truth"], 1.0, "truth", height)
    ends = places[edges[~shown]].astype(np.float32)
    return drawn | {"true hidden edges": dashes(ends, drawing.COLOURS["truth"], 1.0, "truth")}


def _body(
    name: str,
    places: Floats,
    edges: Ints,
    colour: drawing.Colour,
    width: float,
    layer: str,
    height: float,
) -> dict[str, drawing.Primitive]:
    near = _near(places[:, :2], height)
    arms = 3.0 * np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]])
    crosses = (places[near][:, None, None] + arms).reshape(-1, 2, 3)
    kept = edges[near[edges].all(axis=1)]
    return {
        f"{name} edges": lines(places[kept], colour, width, layer),
        f"{name} crosses": lines(crosses, colour, min(width, 1.5), layer),
    }


RADIUS = 2.4
CAMERA_AT, CAMERA_TO = 2.3, 1.9
POINT = 0.07
FLOOR, NAME_AT, MOST_NAMES = 1.5, 1.12, 40
SURE, UNSURE = 0.05, 0.5
"""Standard deviations of a point, in sizes of the body, between which the surface fades."""
MOST_OPAQUE = 0.45
LARGEST_SD = 1e6
"""Largest ellipsoid of a point that is drawn, in sizes of the body; a larger one might exceed 32 bits."""


def shape_world(state: StructureState, target: Target | None, second: Floats | None = None) -> drawing.WorldDrawing:
    """Draw the shape, how sure each point is, the true shape where it is known, and from where it is seen.

    Args:
        state: State of the frame.
        target: The truth, where it is known.
        second: (n, 3) shape of a second run.
    """
    placed, body, true = state.placed, state.body, true_shape(target)
    points, covariances, turn = placed.points, placed.covariances, placed.camera[:, :3]
    if true is not None and placed.known:
        lay = fit_similarity(points, true)
        points, turn = lay(points), turn @ lay.rotation.T
        covariances = lay.scale**2 * (lay.rotation @ covariances @ lay.rotation.T)
    near = np.linalg.norm(points, axis=1) < RADIUS
    drawn: dict[str, drawing.Primitive] = {}
    if true is not None:
        drawn["true edges"] = drawing.Links(_segments(true, body.edges), drawing.COLOURS["truth"], 1.0, "truth")
        drawn["true points"] = dots(true, drawing.COLOURS["truth"], 0.5 * POINT, "truth")
    sd = np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 3.0)
    faces = body.triangles[near[body.triangles].all(axis=1)] if len(body.triangles) else body.triangles
    if placed.known:
        sureness = np.clip((UNSURE - sd) / (UNSURE - SURE), 0.0, 1.0)
        opacity = (MOST_OPAQUE * sureness).astype(np.float32)
        held = np.where(near[:, None], points, 0.0).astype(np.float32)
        each = colours(len(points), drawing.COLOURS["estimate"])
        drawn["surface"] = drawing.Mesh(held, faces.astype(np.int32), each, opacity, "surface")
    drawn["edges"] = drawing.Links(_segments(points, body.edges), drawing.COLOURS["estimate"], 2.0, "shape")
    drawn["points"] = dots(points[near], drawing.COLOURS["estimate"], POINT, "shape")
    bounded = near & (sd < LARGEST_SD)
    drawn["uncertainty"] = drawing.Ellipsoids(
        points[bounded].astype(np.float32),
        covariances[bounded].astype(np.float32),
        colours(int(bounded.sum()), drawing.COLOURS["observation"]),
        0.25,
        "uncertainty",
    )
    if not len(body.edges):
        drawn |= _scatter(points, near, body.names)
    if second is not None:
        other = fit_similarity(second, points)(second)
        drawn["second edges"] = drawing.Links(
            _segments(other, body.edges), drawing.COLOURS["second"], 1.5, "second run"
        )
        inside = other[np.linalg.norm(other, axis=1) < RADIUS]
        drawn["second points"] = dots(inside, drawing.COLOURS["second"], 0.7 * POINT, "second run")
    way = -turn[2]
    ends = np.outer((CAMERA_AT, CAMERA_TO), way)[None].astype(np.float32)
    drawn["camera"] = drawing.Arrows(ends, drawing.COLOURS["camera"], 2.0, "camera")
    return drawing.WorldDrawing(SHAPE_WORLD, drawn)


def _scatter(points: Floats, near: Bools, names: tuple[str, ...]) -> dict[str, drawing.Primitive]:
    """Draw what gives depth to points with nothing between them: stems down to a floor, and their names."""
    feet = points * np.array([1.0, 0.0, 1.0]) + np.array([0.0, FLOOR, 0.0])
    inside = near & (np.linalg.norm(feet, axis=1) < RADIUS)
    stems = np.stack([points, feet], axis=1)[inside].astype(np.float32)
    drawn: dict[str, drawing.Primitive] = {"stems": drawing.Links(stems, drawing.COLOURS["hidden"], 0.5, "shape")}
    for number in np.flatnonzero(near)[:MOST_NAMES]:
        place = points[number].astype(np.float32) * np.float32(NAME_AT)
        if np.linalg.norm(place) < RADIUS:
            drawn[f"name {names[number]}"] = drawing.Text(
                place, names[number], drawing.COLOURS["camera"], "names", anchor="middle"
            )
    return drawn


def _segments(points: Floats, edges: Ints) -> NDArray[np.float32]:
    """Return the edges (m, 2, 3) whose ends are both within the world."""
    ends = points[edges].astype(np.float32).reshape(-1, 2, 3)
    within: NDArray[np.float32] = ends[(np.linalg.norm(ends, axis=2) < RADIUS).all(axis=1)]
    return within


class SimulatedTracksParameters(StructureTrackerParameters, TracksSceneParameters):
    """The simulated body and its trackers."""


def simulate() -> Setup:
    """Wire the simulated body with Bando's values."""
    return Setup(TracksSource, SimulatedTracksParameters(), success=WITHIN)


def wire(sequence: FrameSequence, _mark: None, start: int, _truth: Truth | None) -> Setup:
    """Wire a table of tracks, which needs no mark and has no truth.

    Raises:
        ParameterError: They are not tracks, or have too few or too many points.
    """
    if not isinstance(sequence, TrackSequence):
        raise ParameterError("footage", sequence.index.kind, "tracks of a body's points")
    if not FEWEST_POINTS <= len(sequence.names) <= MOST_POINTS:
        bound = f"the tracks of {FEWEST_POINTS} to {MOST_POINTS} points, enough for a shape and not too many"
        raise ParameterError("footage", len(sequence.names), bound)
    source = RecordedTracks(sequence, named_body(sequence), start)
    return Setup(lambda _seed, _parameters: source, StructureTrackerParameters(), success=WITHIN)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> drawing.Drawing:
    """Draw a frame: what is measured, the shape and the truth over it; and the shape in its own world.

    The shape of a second run is laid on this one's and seen as that is: a row holds only the shape.
    """
    del past
    frame, state = step.frame, step.state
    width, height = (round(float(side)) for side in 2.0 * state.principal_px)
    primitives: dict[str, drawing.Primitive] = {"picture": drawing.Picture(paper(width, height))}
    primitives |= draw_measurements(state, height)
    if isinstance(frame.target, BodyTarget):
        primitives |= true_in_picture(frame.target, height)
    second = None if other is None else np.array(other.estimate).reshape(-1, 3) / SHARE
    if second is not None:
        primitives |= second_in_picture(state, second, height)
    if state.placed.known:
        primitives |= shape_in_picture(state, height)
        primitives["camera"] = frustum(state.principal_px, state.focal_px, (width, height))
    return drawing.Drawing(width, height, primitives, _caption(step), (shape_world(state, frame.target, second),))


def _caption(step: Step) -> str:
    row, state = step.diagnostics, step.state
    error = "" if row.error is None else f"shape error {row.error:.1f} %"
    return caption(row, step.tracker_title, error, *_remarks(state, row))


def _remarks(state: StructureState, row: Diagnostics) -> list[str]:
    """Return remarks on the shape for users."""
    never = int(np.count_nonzero(state.seen.counts == 0))
    said = [f"{never} never seen"] if never else []
    if state.belief.strength <= DEPTH_SEEN or not state.placed.known:
        said.append("depth not seen yet")
    elif row.number("mirrored") == 1.0:
        said.append("mirror image")
    return said


EXPERIMENT = Experiment(
    **read_words(
        FOLDER, TRACKERS, measured=Measured(measure=measure), frames={WITHIN: _within, "frames_to_shape": _within}
    ),
    id="structure",
    # The window of the online methods is full by then, and has slid on.
    warm_frames=92,
    simulate=simulate,
    video=Video(
        wire,
        footage=("tracks",),
        recorded=lambda _kind: StructureTrackerParameters(),
        wanted="left out: all points are followed",
        advice="All points of the table are followed; nothing needs to be marked.",
        truth=None,
    ),
    draw=draw,
    judge=Judge(shape_errors, "%", scale=SHARE),
)
