"""Trackers of the pose of a solid by its features, whatever these look like (document 1, ch. 4).

- `methods`: the ways of tracking; `layered`: features in two layers with an adapting sampling distribution;
- `state`: the posterior of one frame; `parameters`: all that can be set.
"""

__all__: list[str] = []
