"""What whole poses are worth by what their points are: the likelihood of a family's points, to be asked at any pose."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.likelihood import Anchor, Component, ObservationLikelihood
from pftrack.core.model.part import Contributions, Part
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.pose_particles import project_all
from pftrack.experiments.shared.pose.state import PoseState

__all__ = ["pose_likelihood"]

COMPONENTS = (
    Component("theta x", "rad"),
    Component("theta y", "rad"),
    Component("theta z", "rad"),
    Component("x", "mm"),
    Component("y", "mm"),
    Component("z", "mm"),
)
"""How the prism is turned, and where it is in the camera's frame."""


Weigh = Callable[[PoseState, Frame, Any], FeatureLikelihood]
"""(state before, frame, parameters) -> the likelihood of points at positions (F, N, 2) px."""


def pose_likelihood(
    title: str,
    names: tuple[str, ...],
    weigh: Weigh,
    prepare: Callable[[Any, Frame, Any], Any] = lambda state, _frame, _parameters: state,
    most_places: int = 1200,
) -> ObservationLikelihood:
    """Return the likelihood of poses: the points of each, as a pinhole sees them, weighed together.

    Trackers weigh the particles of each point by itself, so theirs have other weights than whole poses.

    Args:
        title: What is compared, a few words.
        names: Of the F points.
        weigh: How points are weighed.
        prepare: See `ObservationLikelihood`.
        most_places: How many poses a map of the picture may ask for.
    """

    def log_likelihood(
        state: PoseState,
        states: NDArray[np.float64],
        frame: Frame,
        parameters: Any,  # noqa: ANN401 - of any family
    ) -> NDArray[np.float64]:
        return np.asarray(weigh(state, frame, parameters)(project_all(states, state.solid)).sum(axis=0))

    def parts(
        state: PoseState,
        one: NDArray[np.float64],
        frame: Frame,
        parameters: Any,  # noqa: ANN401 - of any family
    ) -> tuple[Part, ...]:
        seen = project_all(one[None], state.solid)
        logs = weigh(state, frame, parameters)(seen)[:, 0]
        rows = np.column_stack([seen[:, 0], logs])
        told = tuple(tuple(row) for row in rows.tolist())
        return (Contributions("points of the pose", ("x (px)", "y (px)", "log likelihood"), names, told),)

    return ObservationLikelihood(
        title,
        components=lambda _: COMPONENTS,
        log_likelihood=log_likelihood,
        centre=_centre,
        prepare=prepare,
        anchor=Anchor(_place, _put),
        parts=parts,
        most_places=most_places,
        weighs=False,
    )


def _centre(state: PoseState) -> NDArray[np.float64]:
    """Return angles, rad, and place in the camera's frame, mm, (6,)."""
    return np.concatenate([state.pose.mean, state.translation_mm])


def _place(state: PoseState, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where a pinhole sees the origin of the solid's frame, (N, 2) px."""
    solid = state.solid
    return np.asarray(solid.focal_px * states[:, 3:5] / np.maximum(states[:, 5:], 1.0) + solid.principal_px)


def _put(state: PoseState, one: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses as far away as the one, whose origins are seen at places, (M, 6)."""
    states = np.tile(one, (len(places), 1))
    states[:, 3:5] = (places - state.solid.principal_px) * one[5] / state.solid.focal_px
    return states
