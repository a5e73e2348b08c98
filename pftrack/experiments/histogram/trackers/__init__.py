"""Trackers of a window by the histogram of its colours (Kagami 2012, after Perez et al. 2002).

- `step`: the trackers by name, out of those of `pftrack.experiments.shared.sampling`; `likelihood`: what they weigh
  particles by, `inspection`: the same, to be asked at any place; `greedy`: a search for the best place near the last
  one, which predicts nothing;
- `state`: what is known of the target; `model`: what it looked like, and how that is renewed;
- `search`: how a lost target is noticed and found again; `camera`: how a camera that moves is followed;
- `parameters` and `motion`: all that can be set.
"""

__all__: list[str] = []
