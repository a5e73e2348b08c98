"""Learning: models estimated from what was tracked.

While tracking goes on:

- `online_em`: the dynamics of a second-order autoregression, by expectation maximisation with forgetting;
- `mixture_em`: the ratio in which particles are drawn from two predictions.

From recorded tracks, for later runs:

- `noise_em`: how large the noises of a linear Gaussian model are, by expectation maximisation over a recording;
- `charts`: what the numbers of a recorded state are, and its changes in the body's own frame;
- `diffusion`: the covariance of these changes, from which particles are moved on.
"""

from pftrack.filters.learning import charts, diffusion, mixture_em, online_em

__all__ = ["charts", "diffusion", "mixture_em", "noise_em", "online_em"]
