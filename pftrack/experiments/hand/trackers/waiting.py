"""What happens while no hand can be followed: the trackers say why, keep what they knew, and wait for an open hand.

One frame without a hand, as after a flash, is passed over: the hands that were kept go on from there. After some such
frames, or when no hand that is found fits the silhouette any more, only an open hand tells where the hand is, and that
is found as at the beginning of a recording.
"""

from dataclasses import replace

import numpy as np

from pftrack.experiments.hand.detection.open_hand import NoOpenHandError, find_open_hand
from pftrack.experiments.hand.detection.protrusions import HandFeatures
from pftrack.experiments.hand.trackers.parameters import HandTrackerParameters
from pftrack.experiments.hand.trackers.state import HandState
from pftrack.experiments.hand.trackers.view import wrist_offset
from pftrack.filters.beam import Beam

__all__ = ["NO_FINGER", "judge", "restart", "waiting"]

NO_FINGER = "no finger is seen beside the palm, as of a fist"


def waiting(state: HandState, found: HandFeatures, reason: str) -> HandState:
    """Return a state that stays as it is, and says why."""
    count = len(state.beam)
    beam = Beam(state.beam.members, state.beam.log_weights, np.arange(count))
    return replace(
        state,
        beam=beam,
        origins=np.array(beam.members),
        fit=np.full(count, np.nan),
        protrusions=len(found.protrusions),
        tried=0,
        finding=reason,
        waited=state.waited + 1,
        searching=True,
        particles=None,
        log_evidence=0.0,
    )


def judge(before: HandState, state: HandState, parameters: HandTrackerParameters) -> HandState:
    """Return a state that says so if its best hand does not fit, and that is lost if none has for some frames."""
    share = float(state.fit[state.beam.best])
    if share <= parameters.highest_misfit:
        return state
    misfits = before.misfits + 1
    reason = f"the best hand differs from the silhouette by {100.0 * share:.0f} % of its area"
    lost = misfits >= parameters.lost_after_frames
    return replace(state, misfits=misfits, finding=reason, lost=lost, searching=lost)


def restart(state: HandState, found: HandFeatures) -> HandState:
    """Return the state that begins with the open hand of a frame; or one that waits, and says why there is none."""
    try:
        hand = find_open_hand(found)
    except NoOpenHandError as reason:
        return replace(waiting(state, found, str(reason)), lost=True)
    return HandState(
        Beam.of(hand.pose),
        hand.pose[None],
        hand.shape,
        hand.scale,
        wrist_offset(hand.pose, found),
        np.full(1, hand.misfit),
        protrusions=len(found.protrusions),
    )
