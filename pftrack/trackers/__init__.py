"""Trackers: filters joined with likelihoods into something that follows a target through frames.

A tracker is a pair of pure functions, `start(target, frame, parameters, rng) -> TrackState` and
`step(state, frame, parameters, rng) -> TrackState`. Nothing is hidden in it, so a run can rewind and branch at no cost,
and all trackers of an experiment understand each other's states, so that one may take over from another in mid-run.

- `ball`: the switching filters of document 1, ch. 3, and what they are compared with;
- `layered`: features in two layers, with a sampling distribution that adapts, of document 1, ch. 4;
- `pose`: the methods of that chapter for the pose of a solid, for `prism` (points) and `head` (templates);
- `signal`: the Kalman and the particle filter of document 1, ch. 2.
"""

from pftrack.trackers.tracker import Fold, Tracker, TrackState

__all__ = ["Fold", "TrackState", "Tracker"]
