"""Filters of feature trajectories: many points of one motion model, whose measurements are sometimes far off.

A point that block matching follows through a video sometimes jumps to a similar place. Per axis the motion is smooth
and the measurement is the position,

    p_t = 2 p_{t-1} - p_{t-2} + v_t,  v_t ~ N(0, tau^2),     y_t = p_t + w_t,

and the law of w_t decides the effect of a jump: a Gaussian follows it, a Cauchy law of scale sigma ignores it.

- `gaussian`: Gaussian w_t, the Kalman filter and the exact smoother with a fixed lag; and the estimate of a cloud, by a
  histogram or by the mean;
- `cloud`: Cauchy w_t by particles, whose past is kept as a pruned `tree`; with log sigma^2 and log tau^2 in the state
  it estimates both;
- `whole`: whole tracks at once, the likelihood of sigma^2 and tau^2, and errors.

All work on batches of K independent tracks: a track's numbers do not depend on the other tracks.

Source: N. Ichimura, N. Ikoma, "Filtering of time series of feature point coordinates using non-Gaussian state space
model"; the Monte Carlo filter is G. Kitagawa's, 1996, the tree that of Jacob, Murray and Rubenthaler, 2015.
"""

from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians

__all__ = ["Cloud", "Gaussians"]
