"""Trackers of the pose of a solid by its features, of any kind (Bando 2007, ch. 4).

- `methods`: the methods of tracking, and their reports; `layered`: features in two layers with an adapting sampling
  distribution, and two such filters in parallel;
- `state`: the solid, the belief in it in one frame, likelihoods of poses, and the contribution of each point;
- `calibrated`: parameters, and a calibrated band of the pose;
- `drawing`: pieces of drawings, and measures and plots of a pose.
"""

from pathlib import Path

__all__ = ["SHOWN_OF_POSES"]

SHOWN_OF_POSES = Path(__file__).with_name("shown.yaml")
"""Titles of the trackers, plots, readings and words that all experiments on a pose have."""
