"""Learning: models estimated from what was tracked.

While tracking goes on:

- `online_em`: the dynamics of a second-order autoregression, by expectation maximisation with forgetting; and, from all
  frames of a recording, how large the noises of a linear Gaussian model are;
- `mixture_em`: the ratio in which particles are drawn from two predictions.

From recorded tracks, for later runs:

- `charts`: what the numbers of a recorded state are, and its changes in the body's own frame;
- `diffusion`: the covariance of these changes, from which particles are moved on; how an
  experiment declares that it can be learned from, and the dynamics that follow what was learned.
"""
