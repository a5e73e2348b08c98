"""The particles of a solid's points, laid open for whoever wants to look at one of them."""

import numpy as np

from pftrack.core.model.cloud import Cloud
from pftrack.core.model.likelihood import Component
from pftrack.experiments.shared.pose.beliefs import JointParticles, Layers
from pftrack.experiments.shared.pose.state import PoseState

__all__ = ["SAMPLERS", "point_clouds"]

SAMPLERS = ("the solid's pose", "the feature's own past")
"""What draws the particles of a point: those of the first have no parents."""

OWN = tuple(Component(name, "px") for name in ("x", "y", "x in the last frame", "y in the last frame"))


def point_clouds(names: tuple[str, ...], state: PoseState) -> Cloud | None:
    """Return the particles of the filter that is believed.

    Args:
        names: Of the F points.
        state: What is believed.

    Returns:
        Joint particles (N, 2 F) px, each in the middle of its points; or those of each point's own filter (F N, 4) px,
        point by point.
    """
    if isinstance(state.belief, JointParticles):
        return _joint(names, state.belief)
    return _apart(names, state.belief) if isinstance(state.belief, Layers) else None


def _joint(names: tuple[str, ...], belief: JointParticles) -> Cloud:
    particles = belief.particles
    positions = particles.positions
    states = positions.transpose(1, 0, 2).reshape(positions.shape[1], -1)
    components = tuple(Component(f"{name}, {axis}", "px") for name in names for axis in "xy")
    middle = np.asarray(positions.mean(axis=0))
    return Cloud(
        states,
        particles.log_weights,
        particles.ancestors,
        resampled=particles.resampled,
        components=components,
        places=middle,
        log_likelihoods=particles.log_likelihoods,
    )


def _apart(names: tuple[str, ...], belief: Layers[object]) -> Cloud:
    features, said = belief.layers.features, belief.layers.log_likelihoods
    count = features.log_weights.shape[1]
    drawn = np.stack([features.upper_counts, count - features.upper_counts], axis=1)
    states = features.particles.reshape(-1, 4)
    return Cloud(
        states,
        features.log_weights.ravel(),
        features.parents.ravel(),
        tuple(drawn.ravel().tolist()),
        SAMPLERS,
        components=OWN,
        places=states[:, :2],
        filters=names,
        log_likelihoods=None if said is None else said.ravel(),
    )
