"""How far a shape is from the true one: up to an affine map, as Bando has it, and up to a similarity."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.series import Series, SeriesValue
from pftrack.experiments.structure.trackers.placing import MIRROR
from pftrack.experiments.structure.trackers.state import StructureState
from pftrack.sources.tracks.target import BodyTarget
from pftrack.vision.geometry.face_model import Similarity, fit_similarity

__all__ = ["SERIES", "SHARE", "align_similarity", "measure", "shape_errors", "true_shape"]

SHARE = 100.0
"""Percent of the body's size."""

WITHIN = {"within_50": 2.366, "within_95": 7.815}
"""Squares of the half axes, in standard deviations, of ellipsoids that hold so much of a Gaussian in three numbers."""

LEAST_VARIANCE = 1e-12
"""Of a point in any direction: one that is exactly known must not divide by zero."""

FLAT = 1e-7
"""Extent in a direction, relative to the greatest, that is none."""

SERIES = (
    Series("metric_error", "error up to a similarity", "%"),
    Series("mirrored", "mirror image", role="mirrored"),
    Series("turn_error_deg", "error of the pose", "°"),
    *(
        Series(f"within_{share}", f"points within their ellipsoids of {share} %", shape="vector", role="flag")
        for share in (50, 95)
    ),
)


def shape_errors(estimates: NDArray[np.float64], truths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shape errors (...), % (Bando 2007, eq. 4.19), of shapes (..., 3 n): what an affine map leaves.

    The best affine map takes of the true coordinates what the estimated ones span, so the error is what they do not.
    That holds of a flat shape as well, which spans less.
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


def true_shape(target: object) -> NDArray[np.float64] | None:
    """Return the true shape (n, 3) of a target, where it is known."""
    if not isinstance(target, BodyTarget) or not target.position.any():
        return None
    return target.position.reshape(-1, 3)


def align_similarity(points: NDArray[np.float64], other: NDArray[np.float64]) -> Similarity:
    """Return the similarity, never a mirror image, that lays a shape on another one."""
    return fit_similarity(points, other)


def measure(frame: Frame, state: StructureState) -> Mapping[str, SeriesValue]:
    """Return the values of the series, where the truth is known."""
    true, target = true_shape(frame.target), frame.target
    if true is None or not isinstance(target, BodyTarget) or not state.placed.known:
        return {}
    points = state.placed.points
    lay = align_similarity(points, true)
    apart, mirrored = (_apart(one, true) for one in (points, points * MIRROR))
    off = state.placed.camera[:, :3] @ lay.rotation.T @ target.turn.T
    return {
        "metric_error": SHARE * apart,
        "mirrored": float(mirrored < apart),
        "turn_error_deg": float(np.rad2deg(np.arccos(np.clip((np.trace(off) - 1.0) / 2.0, -1.0, 1.0)))),
        **_within(state, lay.inverse(true)),
    }


def _within(state: StructureState, true: NDArray[np.float64]) -> Mapping[str, SeriesValue]:
    """Return which points are within their ellipsoids, given the true shape (n, 3) as it lies best on the estimate."""
    off = true - state.placed.points
    covariances = state.placed.covariances + LEAST_VARIANCE * np.eye(3)
    squares = (off * np.linalg.solve(covariances, off[:, :, None])[:, :, 0]).sum(axis=1)
    return {name: tuple((squares <= limit).astype(np.float64).tolist()) for name, limit in WITHIN.items()}


def _apart(points: NDArray[np.float64], true: NDArray[np.float64]) -> float:
    """Return what a similarity leaves of the true shape, relative to its size."""
    return float(np.sqrt(np.square(align_similarity(points, true)(points) - true).sum() / np.square(true).sum()))
