"""Trackers that draw particles by prediction, by observation, or by both (Bando 2007, ch. 3), whatever they weigh by.

- `loop`: one compiled loop over frames for all of them;
- `samplers`: the members by name, the rules by which they choose, the model that they weigh by, what they report;
- `parameters`: what can be set on them.

A family brings a `LoopModel`, with the likelihood, the motion and how its trackers begin: `pftrack.experiments.ball`
weighs the colour under a particle, `pftrack.experiments.histogram` the colours of a window.
"""

__all__: list[str] = []
