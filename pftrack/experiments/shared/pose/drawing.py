"""Pieces of drawings of a solid tracked by its points, and measures, plots and readings of its pose.

A drawing places the picture behind the solid, clear of it, and the camera a focal length before the picture: so a px in
the plane of the picture is a fixed number of mm, and everything else has its true proportions. The pose is given as
yaw, pitch and roll of the face (`pftrack.vision.face.gaze`), in degrees, each with its standard deviation and, where it
is known, the truth.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS, Axes, Colour, Links, Points, Primitive, Text
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Landmarks
from pftrack.core.numerics.elementary import wrap
from pftrack.core.numerics.matrices import NEAREST_MM
from pftrack.experiments.experiment import Judge
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import at_height, before_camera, frustum, lines, uncertainty
from pftrack.vision.face import gaze


def heights(state: PoseState, depths_mm: Floats) -> Floats:
    """Return how high above the picture a drawing shows what is at depths (n,) in the camera's frame, (n,) px."""
    radius = float(np.linalg.norm(state.solid.points_mm, axis=1).max())
    return before_camera(depths_mm, state.solid.focal_px, max(float(state.translation_mm[2]), NEAREST_MM), radius)


def place_points(state: PoseState, points_mm: Floats, theta: Floats | None = None) -> Floats:
    """Return where points (n, 3) of the solid are seen, and how high above the picture they stand, (n, 3) px.

    Args:
        state: The belief.
        points_mm: In the solid's frame.
        theta: Angles (3,) of the solid, rad; by default the believed ones.
    """
    turn = rotation(state.pose.mean if theta is None else theta)
    depths = points_mm @ turn[2] + state.translation_mm[2]
    return np.column_stack([state.project(points_mm, theta), heights(state, depths)])


MOST_DRAWN = 5000
NAMES_DOWN = 18
"""Names, one below the other, that fill the height of a picture and can still be read where it is small."""

UPPER, LOWER = COLOURS["observation"], COLOURS["prediction"]
"""Particles from the solid's prediction, and from the feature's own past."""


def feature_clouds(state: PoseState, size: float) -> dict[str, Primitive]:
    """Draw the particles of all features, as deep as these, coloured by which prediction they came from."""
    positions = state.belief.positions
    features, count, _ = positions.shape
    stride = max(1, -(-features * count // MOST_DRAWN))
    chosen = np.arange(0, count, stride)
    log_weights = np.broadcast_to(state.belief.log_weights, (features, count))[:, chosen]
    relative = np.exp(log_weights - log_weights.max(axis=1, keepdims=True))
    colours = np.where((chosen < state.belief.upper_counts[:, None])[:, :, None], UPPER, LOWER).astype(np.uint8)
    depths = place_points(state, state.solid.points_mm)[:, 2:] + 10.0 * relative
    raised = at_height(positions[:, chosen].reshape(-1, 2), depths.ravel())
    return {"particles": Points(raised, colours.reshape(-1, 3), size, "particles by prediction")}


def feature_marks(state: PoseState, names: tuple[str, ...]) -> dict[str, Primitive]:
    """Draw each feature's uncertainty, vermilion while it is not recognised."""
    marks = zip(names, state.feature_means, state.feature_covariances, _colours(state), strict=True)
    return {
        f"feature {name}": uncertainty(mean, covariance, colour, "features", width=1.0)
        for name, mean, covariance, colour in marks
    }


def feature_names(
    state: PoseState, names: tuple[str, ...], places: Floats, titles: Mapping[str, str] | None = None
) -> dict[str, Primitive]:
    """Draw the features' names at places (F, 2) px, and lines that lead to them.

    Args:
        state: Belief with the features' places.
        names: Names of the features.
        places: (F, 2) of the names, px.
        titles: The names written out, where these are short. They run away from their features.
    """
    ends = np.stack([places, state.feature_means], axis=1)
    drawn: dict[str, Primitive] = {"name lines": lines(ends, COLOURS["hidden"], 1.0, "names", height=2.0)}
    points, titles = at_height(state.feature_means, 2.0), titles or {}
    for name, place, point, colour in zip(names, at_height(places, 2.0), points, _colours(state), strict=True):
        drawn[f"name {name}"] = Text(
            place,
            name,
            colour,
            "names",
            anchor="middle" if name not in titles else "end" if place[0] < point[0] else "start",
            title=titles.get(name, ""),
            point=point,
        )
    return drawn


def beside(points: Floats, plan: Floats, height: float) -> Floats:
    """Return places (n, 2) for the names of points (n, 2) without overlaps, in two columns beside them.

    Args:
        points: px.
        plan: (n, 2) places of the points on the object, which set side and order, so names do not jump.
        height: Height of the picture, px.
    """
    places, gap = np.empty_like(points), height / NAMES_DOWN
    low, high = points.min(axis=0), points.max(axis=0)
    margin = (high - low).max() / 2.0
    for side, x in ((plan[:, 0] <= 0.0, low[0] - margin), (plan[:, 0] > 0.0, high[0] + margin)):
        rank = np.argsort(np.argsort(plan[side, 1], kind="stable"))
        places[side, 0] = x
        places[side, 1] = points[side, 1].mean() + gap * (rank - (len(rank) - 1) / 2.0)
    return places


def _colours(state: PoseState) -> list[Colour]:
    return [COLOURS["estimate"] if recognised else COLOURS["lost"] for recognised in state.recognised]


def model_points(state: PoseState, size: float) -> dict[str, Primitive]:
    """Draw the solid's points in its estimated pose, and the ways to where they are tracked in the picture."""
    points = place_points(state, state.solid.points_mm)
    arms = size * np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]])
    crosses = (points[:, None, None] + arms).reshape(-1, 2, 3).astype(np.float32)
    ways = np.stack([at_height(state.feature_means, 1.0), points.astype(np.float32)], axis=1)
    return {
        "ways": Links(ways, COLOURS["hidden"], 1.0, "model points"),
        "model points": Links(crosses, COLOURS["estimate"], 1.0, "model points"),
    }


def draw_with_rim(name: str, lines: Links) -> dict[str, Primitive]:
    """Draw dark lines with a light rim, visible on any picture."""
    rim = replace(lines, colour=COLOURS["paper"], width=lines.width + 1.0)
    return {f"{name} rim": rim, name: lines}


def true_marks(landmarks: Landmarks, size: float) -> dict[str, Primitive]:
    """Draw a cross where each feature truly is, grey where it is hidden."""
    drawn: dict[str, Primitive] = {}
    arms = size * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
    for name, chosen, colour in (
        ("true features", landmarks.visible, COLOURS["truth"]),
        ("hidden features", ~landmarks.visible, COLOURS["hidden"]),
    ):
        crosses = landmarks.points_px[chosen][:, None, None, :] + arms
        drawn[name] = lines(crosses.reshape(-1, 2, 2), colour, 1.0, "truth", height=2.0)
    return drawn


def pose_axes(state: PoseState, origin_mm: Floats, length_mm: float) -> dict[str, Primitive]:
    """Draw the solid's own axes at a point of it, with z pointing out of the picture for a solid at rest.

    The axes that lie in the picture then are named; a third name would cover the others whenever the solid is turned.
    """
    directions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    ends = place_points(state, origin_mm + length_mm * directions).astype(np.float32)
    length = length_mm * state.solid.scale
    axes = (ends[1:] - ends[0]).T / np.float32(length)
    colour = COLOURS["estimate"]
    drawn: dict[str, Primitive] = {"axes": Axes(ends[0], axes, length, colour, 2.0, "axes")}
    for name, end in (("x", ends[1]), ("y", ends[2])):
        drawn[f"axis {name}"] = Text(
            ends[0] + np.float32(1.15) * (end - ends[0]), name, colour, "axes", anchor="middle"
        )
    return drawn


def camera(state: PoseState, size: tuple[int, int]) -> dict[str, Primitive]:
    """Draw the camera that the solid is assumed to be seen by, a focal length before its picture of a size, px."""
    return {"camera": frustum(state.solid.principal_px, state.solid.focal_px, size)}


def dashes(segments: NDArray[np.float32], colour: Colour, width: float, layer: str, *, length: float = 6.0) -> Links:
    """Draw segments (n, 2, 3) as broken lines.

    Args:
        segments: Ends, px.
        colour: Colour of the dashes.
        width: Width of the dashes, px.
        layer: Their layer.
        length: Length of a dash and of the gap after it, px.
    """
    ways = segments[:, 1] - segments[:, 0]
    counts = np.maximum(1, np.rint(np.linalg.norm(ways, axis=1) / (2.0 * length)).astype(np.int64))
    owners = np.repeat(np.arange(len(segments)), counts)
    within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    shares = (within[:, None] + np.array([0.0, 0.5])) / counts[owners, None]
    broken = segments[owners, None, 0] + shares[:, :, None] * ways[owners, None]
    return Links(broken.astype(np.float32), colour, width, layer)


# Whether the truth lies in the central 50 % and 95 % of the posterior is written down for each angle, in the order
# (theta_x, theta_y, theta_z): over many frames it should, as often as that.

ANGLES = ("yaw", "pitch", "roll")
THETA = ("theta_x", "theta_y", "theta_z")


def pose_series(features: tuple[str, ...]) -> tuple[Series, ...]:
    """Return what `pose_measure` measures of a solid whose features have these names."""
    return (
        *(
            Series(f"{angle}_deg{suffix}", f"{words}{angle}", "°")
            for angle in ANGLES
            for suffix, words in (("", ""), ("_sd", "standard deviation of the "), ("_true", "true "))
        ),
        Series("feature_visible", "visible", shape="vector", role="visible", components=features),
        Series("feature_error_px", "distance from the truth", "px", "vector", components=features),
        *(
            Series(name, f"truth in the central {share} %", shape="vector", role="flag", components=THETA)
            for name, share in (("within_50", 50), ("within_95", 95))
        ),
    )


def pose_measure(frame: Frame, state: PoseState) -> Mapping[str, SeriesValue]:
    """Return the measurements of a frame by name; without a truth, those of the estimate alone."""
    found, spread = np.rad2deg(gaze(state.estimate)), np.rad2deg(_gaze_sd(state))
    values: dict[str, SeriesValue] = {}
    for place, angle in enumerate(ANGLES):
        values[f"{angle}_deg"] = float(found[place])
        values[f"{angle}_deg_sd"] = float(spread[place])
    known = frame.target
    if known is None:
        return values
    truth = np.rad2deg(gaze(known.position))
    off = np.abs(wrap(state.estimate - known.position)) / state.sigma
    for place, angle in enumerate(ANGLES):
        values[f"{angle}_deg_true"] = float(truth[place])
    values |= {"within_50": _numbers(off <= state.widths.half), "within_95": _numbers(off <= state.widths.most)}
    landmarks = known.landmarks
    if landmarks is not None:
        values["feature_visible"] = _numbers(landmarks.visible)
        values["feature_error_px"] = _numbers(np.hypot(*(state.feature_means - landmarks.points_px).T))
    return values


def mean_error_deg(estimates: Floats, truths: Floats) -> Floats:
    """Return the mean over the axes of the absolute errors (...), degrees, of angles (..., 3), rad."""
    error: Floats = np.rad2deg(np.abs(wrap(estimates - truths)).mean(axis=-1))
    return error


JUDGE = Judge(
    mean_error_deg, "deg", lambda errors, _sizes, parameters: errors > parameters.lost_deg, scale=float(np.rad2deg(1.0))
)
"""Comparison of poses with the truth."""


def _gaze_sd(state: PoseState) -> Floats:
    """Return the standard deviations of yaw, pitch and roll (3,), rad; the roll's as if it were theta_z."""
    return state.sigma[[1, 0, 2]]


def _numbers(values: Floats | Bools) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).tolist())
