"""Likelihoods: how well a picture agrees with a hypothesis.

A likelihood is a fitted model that turns a picture and states (N, d) into log densities (N,), up to a constant that is
the same for all states. Likelihoods do not depend on filters.

- `chromaticity`: the colour of the one pixel under the particle, brightness taken out;
- `histogram`: the colours of the window around it, compared with those of a model and of the surroundings; `counting`
  counts many windows at once;
- `points`: measured positions of several features, each with its own noise, and features that may be hidden;
- `template`: patches of the first frame by normalised correlation;
- `edges`: the distance of an outline from the picture's edges;
- `separation`: whether a likelihood separates a target from its surroundings, and templates in relief.
"""
