"""A shape to begin with where nothing is known of the body: from its first frames (see `recursive`)."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import nearest_rotation
from pftrack.vision.structure import recursive, variational
from pftrack.vision.structure.recursive import Recursive, Settings
from pftrack.vision.structure.tracks import Tracks
from pftrack.vision.structure.variational import Variational

__all__ = ["from_window", "pinhole_of"]

SPREAD = 0.15
"""Standard deviation of the first shape's coordinates, relative to that of the points about their centre: of more the
first frames make leaps from which there is no way back."""

LEAST_STRENGTH = 1.5
"""Of the third direction of the shape, below which it may be noise."""

SMALLEST = 1e-12
"""Scale of a camera that has seen nothing."""


def from_window(tracks: Tracks, settings: Settings, found: Variational | None = None) -> Recursive:
    """Begin without a prior, by the variational factorization of the first frames; the unit is such that 1 is 1 px.

    Args:
        tracks: The first frames; positions from the principal point.
        settings: How to go on.
        found: Their factorization, if it is there already.

    Raises:
        ValueError: The frames do not tell a shape: there are fewer than three, or there is no rotation or no depth.
    """
    found = found or variational.fit(tracks)
    if not found.strengths[2] > LEAST_STRENGTH:
        raise ValueError(
            "expected a body that turns and points that do not lie in one plane: the depth in these frames is no more "
            f"than noise makes (strength {found.strengths[2]:.2g}, at least {LEAST_STRENGTH:g} is needed)"
        )
    found = variational.metric(found)
    if not np.isfinite(found.shape).all():
        raise ValueError("expected cameras that determine a metric shape, got frames from which none comes")
    best: tuple[float, Recursive] | None = None
    for state in _mirror(found, settings, tracks.seen):
        total, after = 0.0, state
        for positions, variances in zip(tracks.positions, tracks.variances, strict=True):
            after = recursive.step(after, positions, variances)
            total += after.log_evidence
        if best is None or total > best[0]:
            best = total, after
    if best is None:
        raise RuntimeError("there are two mirror images")
    return best[1]


def _mirror(found: Variational, settings: Settings, seen: NDArray[np.bool_]) -> Iterator[Recursive]:
    """Yield the beginnings with both mirror images of a metric shape; a point that was never seen may be anywhere."""
    spread = SPREAD * float(np.sqrt(found.shape.var(axis=0).mean()))
    covariance = np.where(seen[:, None, None], spread**2 * np.eye(3), found.shape_covariances)
    for sign in (1.0, -1.0):
        mirror = np.array([1.0, 1.0, sign])
        yield recursive.begin(
            found.shape * mirror,
            covariance * np.outer(mirror, mirror),
            settings,
            pinhole_of(found.motion[:2] * np.append(mirror, 1.0), settings.focal_px),
        )


def pinhole_of(rows: NDArray[np.float64], focal_px: float) -> NDArray[np.float64]:
    """Return the pinhole (3, 4) that is nearest to the rows (2, 4) of an orthographic camera."""
    across, down = rows[:, :3]
    scale = max(float(np.sqrt(0.5 * (np.square(across).sum() + np.square(down).sum()))), SMALLEST)
    turn = nearest_rotation(np.array([across, down, np.cross(across, down) / scale]))
    return np.column_stack([turn, [rows[0, 3] / scale, rows[1, 3] / scale, focal_px / scale]])
