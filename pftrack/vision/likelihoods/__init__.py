"""Likelihoods: how well a picture agrees with a hypothesis.

A likelihood is a model fitted beforehand that turns a picture and states (N, d) into log densities (N,), up to a
constant that is the same for all states. Likelihoods know no filters.

- `chromaticity`: the colour of the one pixel under the particle, brightness taken out;
- `histogram`: the colours of the window around it, compared with those of a model and of what is around; `counting`:
  how many windows are counted at once;
- `points`: measured positions of several features, each with its own noise, and features that may be hidden;
- `template`: patches of the first frame by normalised correlation;
- `edges`: how near an outline is to the picture's edges;
- `separation`: whether a likelihood tells a target from what is around it, and templates in relief.
"""
