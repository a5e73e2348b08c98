"""What people who look into a frame of a chain are told: its hypotheses laid open, and what cut the ranges."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.cloud import Cloud
from pftrack.core.model.part import Amount, Contributions, Part
from pftrack.experiments.linkage.scene.truth import in_degrees
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.experiments.shared.reports import hypotheses_cloud
from pftrack.filters.particles import ParticleSet

__all__ = ["hypotheses_of", "particles_of", "range_parts"]

FLAT = ("theta 1", "theta 2", "theta 3", "length 1", "length 2", "length 3")
SPATIAL = ("omega x", "omega y", "omega z", "t x", "t y", *FLAT)
"""Names of the numbers of an estimate, in the plane and in space; angles in degrees, the others in px."""


def particles_of(state: LinkageState) -> Cloud | None:
    """Return particles, laid open; None of hypotheses, of which the particle filter drew its first ones."""
    belief = state.belief
    return Cloud(belief.states, belief.log_weights, belief.ancestors) if isinstance(belief, ParticleSet) else None


def hypotheses_of(state: LinkageState) -> Cloud | None:
    """Return hypotheses, laid open; None of particles, of which a beam makes one hypothesis."""
    belief = state.belief
    if isinstance(belief, ParticleSet):
        return None
    poses = np.array([member.pose for member in belief.members])
    return hypotheses_cloud(poses, belief.log_weights, belief.parents)


def range_parts(before: LinkageState, state: LinkageState, frame: object, parameters: object) -> tuple[Part, ...]:
    """Return how the frame has changed the range of each number, and what happened to hypotheses and bounds.

    A range is all that is not excluded, or two standard deviations to either side. It grows by what may have moved, and
    is cut by what was seen and by the bounds of joints and lengths.
    """
    del frame, parameters
    events = state.events
    happened = (
        Amount("bounds that cut", float(events.truncated)),
        Amount("hypotheses refuted", float(events.refuted)),
        Amount("hypotheses merged", float(events.merges)),
        Amount("hypotheses added", float(events.splits)),
    )
    if before is state or len(before.low) != len(state.low):
        return happened
    old, new = (_widths(each) for each in (before, state))
    low, high = in_degrees(state.low), in_degrees(state.high)
    change = 100.0 * (new / np.maximum(old, 1e-12) - 1.0)
    rows = tuple(map(tuple, np.column_stack([low, high, old, new, np.where(old > 0.0, change, np.nan)]).tolist()))
    names = SPATIAL if state.in_space else FLAT
    columns = ("from", "to", "width before", "width", "change (%)")
    return (Contributions("ranges, before and after the frame (° or px)", columns, names, rows), *happened)


def _widths(state: LinkageState) -> NDArray[np.float64]:
    return np.asarray(in_degrees(state.high) - in_degrees(state.low))
