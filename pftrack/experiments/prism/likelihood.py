"""What poses of a prism are weighed by, its measured vertices, to be asked at any pose."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Measurements
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.pose_likelihood import pose_likelihood
from pftrack.experiments.shared.pose.pose_particles import project_all
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.sources.prism import NAMES
from pftrack.vision.likelihoods import points

__all__ = ["LIKELIHOOD", "measured_of"]


def measured_of(frame: Frame) -> Measurements:
    """Return the measured vertices of a frame.

    Raises:
        ValueError: It has none.
    """
    if frame.measurements is None:
        raise ValueError("a prism is tracked by measured vertices, got a frame without any")
    return frame.measurements


def _weigh_points(state: PoseState, frame: Frame, parameters: object) -> FeatureLikelihood:
    del state, parameters
    measured = measured_of(frame)
    noise_sd = measured.sd_px.astype(np.float64)
    return lambda positions: points.log_likelihood(positions, measured.points_px, noise_sd)


def _log_likelihood(
    state: PoseState, states: NDArray[np.float64], frame: Frame, parameters: object
) -> NDArray[np.float64]:
    """Return the same of all vertices; one that was not measured says nothing."""
    del parameters
    measured = measured_of(frame)
    sd = measured.sd_px.astype(np.float64).reshape(len(measured.sd_px), -1)[:, None]
    off = (project_all(states, state.solid) - measured.points_px[:, None]) / sd
    return np.asarray(-0.5 * np.square(np.where(np.isfinite(off), off, 0.0)).sum(axis=(0, 2)))


LIKELIHOOD = replace(
    pose_likelihood("measured vertices", NAMES, _weigh_points, most_places=4800), log_likelihood=_log_likelihood
)
"""How well the measured vertices are where a pinhole sees those of a pose."""
