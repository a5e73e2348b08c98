"""Learning: models estimated from what was tracked.

While tracking goes on:

- `online_em`: the dynamics of a second-order autoregression, by expectation maximisation with forgetting; and, from all
  frames of a recording, the noises of a linear Gaussian model;
- `mixture_em`: the ratio in which particles are drawn from two predictions.

From recorded tracks, for later runs:

- `charts`: the meaning of the numbers of a recorded state, and its changes in the body's own frame;
- `diffusion`: the covariance of these changes, which moves particles; the declaration by which an experiment offers its
  runs for learning; and the learned dynamics.
"""
