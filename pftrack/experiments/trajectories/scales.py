"""The scales of noise and motion of the selected track in a plane of their own: log sigma across, log tau upwards.

The surface is the likelihood of both under Gaussian noise, of the last frames: where there are outliers its top lies at
a larger sigma, since a Gaussian has no other way to explain them. The points are the particles of the filter that finds
the scales itself; where there are ever fewer of them is where it has settled. The cross is what the others are given.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Arrows, Links, Mesh, Points, Primitive, Text, WorldDrawing
from pftrack.core.model.palette import VIRIDIS
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import log_likelihoods

__all__ = ["SCALES_WORLD", "scales_world"]

MIDDLE, HALF = (0.25, -0.75), (1.25, 1.25)
"""log10 of sigma and tau in the middle, px, and how far they are shown to either side: 0.1 to 32 px, 0.01 to 3.2 px."""

STEPS = 21
HEIGHT, DEEPEST = 0.8, 30.0
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
RADIUS = 2.1

SCALES_WORLD = World(
    "scales",
    "Scales",
    "decades",
    RADIUS,
    middle=(0.0, 0.0, 0.0),
    up=(0.0, 0.0, 1.0),
    front=(0.0, -1.0, 0.0),
    viewpoints=(Viewpoint("3-d", "3-D", -20.0, 40.0), Viewpoint("top", "Top", 0.0, 90.0)),
)


def scales_world(state: TrajectoriesState, parameters: TrajectoriesTrackerParameters) -> WorldDrawing:
    """Draw the likelihood of the scales, the particles that have scales of their own, and the scales that are given."""
    given = np.log10([parameters.noise_variance_px2, parameters.drive_variance_px2]) / 2.0
    drawn: dict[str, Primitive] = {"axes": Arrows(_axes(), COLOURS["hidden"], 1.5, "scales")}
    for number, (text, sigma, tau) in enumerate(TICKS):
        place = np.array([*_place(np.log10([sigma, tau])), 0.0], np.float32)
        drawn[f"tick {number}"] = Text(place, text, COLOURS["camera"], "scales", "middle")
    track = state.raw[:FRAMES, state.selected][::-1] if state.raw.shape[1] else np.zeros((0, 2))
    if np.isfinite(track).all(axis=1).sum() > 2:
        drawn["likelihood"] = _surface(np.ascontiguousarray(track), float(parameters.start_spread_px))
    laws = state.belief.laws(state.selected) if isinstance(state.belief, Cloud) else None
    if laws is None:
        drawn["given"] = Links(_cross(_place(given)), COLOURS["estimate"], 2.5, "scales")
    else:
        logs, shares = laws
        order = np.argsort(-shares, kind="stable")[:MOST_POINTS]
        places = _place(logs[order] / (2.0 * np.log(10.0)))
        inside = places[(np.abs(places) <= HALF).all(axis=1)]
        raised = np.column_stack([inside, np.full(len(inside), HEIGHT + 0.05)]).astype(np.float32)
        colours = np.tile(np.array(COLOURS["prediction"], np.uint8), (len(raised), 1))
        drawn["particles of the scales"] = Points(raised, colours, POINT, "scales")
    return WorldDrawing(SCALES_WORLD, drawn)


def _place(logs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where log10 of sigma and tau (..., 2) are in the world."""
    return np.asarray(logs) - MIDDLE


def _axes() -> NDArray[np.float32]:
    across, up = HALF
    corner = (-across, -up, 0.0)
    return np.array([[corner, (across, -up, 0.0)], [corner, (-across, up, 0.0)]], np.float32)


def _cross(place: NDArray[np.float64]) -> NDArray[np.float32]:
    inside = np.clip(place, [-HALF[0], -HALF[1]], HALF)
    arms = CROSS * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    flat = inside + arms
    return np.concatenate([flat, np.full((2, 2, 1), HEIGHT + 0.05)], axis=2).astype(np.float32)


def _surface(track: NDArray[np.float64], start_sd: float) -> Mesh:
    """Draw the likelihood of a track (T, 2) over the plane, the higher and lighter the likelier."""
    across, up = (np.linspace(-half, half, STEPS) for half in HALF)
    x, y = (values.ravel() for values in np.meshgrid(across, up, indexing="ij"))
    noise, drive = (10.0 ** (2.0 * (values + middle)) for values, middle in zip((x, y), MIDDLE, strict=True))
    logs = log_likelihoods(track, noise, drive, start_sd)
    shares = np.clip(1.0 + (logs - logs.max()) / DEEPEST, 0.0, 1.0)
    vertices = np.column_stack([x, y, HEIGHT * shares]).astype(np.float32)
    colours = np.array(VIRIDIS, np.uint8)[np.rint(shares * (len(VIRIDIS) - 1)).astype(np.int64)]
    return Mesh(vertices, _faces(), colours, 0.85, "scales")


def _faces() -> NDArray[np.int32]:
    first = (np.arange(STEPS - 1)[:, None] * STEPS + np.arange(STEPS - 1)).ravel()
    corners = np.stack([first, first + 1, first + STEPS, first + STEPS, first + 1, first + STEPS + 1], axis=1)
    return corners.reshape(-1, 3).astype(np.int32)
