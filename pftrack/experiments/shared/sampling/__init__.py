"""Trackers that draw particles by prediction, by observation, or by both (Bando 2007, ch. 3), whatever they weigh by.

- `loop`: one compiled loop over frames for all of them; `likelihood`: what it weighs particles by;
- `samplers`: the members by name, with the rules by which they choose, and what they report;
- `parameters`: what can be set on them; `common`: what they need of frames and of other methods' states.

A family brings the likelihood, the motion and how its trackers begin: `ball` a colour under the particle, `histogram`
the colours of a window.
"""

__all__: list[str] = []
