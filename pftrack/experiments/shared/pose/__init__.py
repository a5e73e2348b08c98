"""Trackers of the pose of a solid by its features, whatever these look like (Bando 2007, ch. 4).

- `methods`: the ways of tracking, and what they report; `layered`: features in two layers with an adapting sampling
  distribution, and two such filters beside each other;
- `state`: the solid, what is believed of it in one frame, what poses are worth, and what each point contributes;
- `calibrated`: all that can be set, and a band of the pose that holds the truth;
- `drawing`: pieces of drawings, and what is measured and plotted of a pose.
"""

from pathlib import Path

__all__ = ["SHOWN_OF_POSES"]

SHOWN_OF_POSES = Path(__file__).with_name("shown.yaml")
"""Titles of the trackers, plots, readings and words that all experiments on a pose have."""
