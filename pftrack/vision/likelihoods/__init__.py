"""Likelihoods: how well a picture agrees with a hypothesis.

A likelihood is a model fitted beforehand that turns a picture and states (N, d) into log densities (N,), up to a
constant that is the same for all states. Likelihoods know no filters. Members:

- `chromaticity`: the colour of the one pixel under the particle, brightness taken out;
- `histogram`: the colours of the window around it, compared with those of a model;
- `points`: measured positions of several features, each with its own noise;
- `template`: patches of the first frame by normalised correlation, and a bank of them by pose (`template_bank`).

Whether any of them tells a target from what is around it is asked by `separation`.
"""

from pftrack.vision.likelihoods import chromaticity, histogram, points, separation, template

__all__ = ["chromaticity", "histogram", "points", "separation", "template", "template_bank"]
