"""The particles of all points of a solid at once, laid open for whoever wants to look at one of them."""

import numpy as np

from pftrack.model.cloud import Cloud
from pftrack.model.likelihood import Component
from pftrack.trackers.pose.beliefs import JointParticles
from pftrack.trackers.pose.state import PoseState

__all__ = ["joint_cloud"]


def joint_cloud(names: tuple[str, ...], state: PoseState) -> Cloud | None:
    """Return the particles of the Rao-Blackwellised filter, (N, 2 F) px, each in the middle of its points.

    None of a belief in which each point has particles of its own: a frame draws some of these anew, from the solid's
    pose, so that they have no parents.

    Args:
        names: Of the F points.
        state: What is believed.
    """
    if not isinstance(state.belief, JointParticles):
        return None
    particles = state.belief.particles
    positions = particles.positions
    states = positions.transpose(1, 0, 2).reshape(positions.shape[1], -1)
    components = tuple(Component(f"{name}, {axis}", "px") for name in names for axis in "xy")
    middle = np.asarray(positions.mean(axis=0))
    return Cloud(states, particles.log_weights, particles.ancestors, components=components, places=middle)
