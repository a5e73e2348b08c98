"""Trackers of a ball by its colour (Bando 2007, ch. 3).

- `step`: the trackers by name, out of those of `pftrack.experiments.shared.sampling`; `likelihood`: what they weigh
  particles by, to be asked at any place as well; `centroid`: trackers that measure the whole picture; `guided`: one
  that moves as was learned, `learned`: from what; `common`: how all of them begin;
- `motion`: the dynamics, learned or given; `parameters`: all that can be set, in parts for other families.
"""

__all__: list[str] = []
