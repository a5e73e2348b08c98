"""What each point of a solid contributes to its pose, for people who look into a frame."""

import numpy as np

from pftrack.core.model.part import Contributions, Part
from pftrack.experiments.shared.pose.beliefs import Layers
from pftrack.experiments.shared.pose.state import PoseState

__all__ = ["LONGER", "contribution_parts"]

LONGER = 5.0
"""Factor by which arrows are longer than what they show, which is a pixel or two."""


def contribution_parts(
    names: tuple[str, ...], before: object, state: PoseState, frame: object, parameters: object
) -> tuple[Part, ...]:
    """Return which point pulls which way: its residual, alpha, and its share in the estimate.

    The residual is where a point is believed to be, less where the estimated pose has it. Its share is that of its
    information, (1 - probability that it is hidden) / variance, in that of all points.
    """
    del before, frame, parameters
    belief = state.belief
    placed, means = state.project(state.solid.points_mm), state.feature_means
    off = means - placed
    variances = np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0
    information = (1.0 - belief.hidden) / np.maximum(variances, 1e-12)
    shares = information / max(float(information.sum()), 1e-12)
    alpha = belief.ratios if isinstance(belief, Layers) else np.full(len(names), np.nan)
    rows = np.column_stack([off, np.sqrt(variances), belief.hidden, alpha, 100.0 * shares])
    arrows = np.column_stack([placed, placed + LONGER * off])
    return (
        Contributions(
            f"which point pulls which way (arrows {LONGER:g} times as long)",
            ("x (px)", "y (px)", "sd (px)", "hidden", "alpha", "share (%)"),
            names,
            tuple(map(tuple, rows.tolist())),
            tuple(map(tuple, arrows.tolist())),
        ),
    )
