"""Trackers of the pose of a solid by its features, whatever these look like (Bando 2007, ch. 4).

- `methods`: the ways of tracking; `layered`: features in two layers with an adapting sampling distribution;
- `solid`: what is known beforehand; `beliefs`: layers or joint particles, behind one protocol;
- `pose_likelihood`, `contributions`: what poses are worth, and what each point says, for people who look into a frame;
- `state`: the posterior of one frame; `reports`: what is measured of it; `parameters`: all that can be set.
"""

__all__: list[str] = []
