"""Filters: from the posterior of one frame to the posterior of the next.

A Bayesian filter repeats two things: predict the state by the dynamics, then weigh the prediction by what is observed.
The members differ in how they represent the posterior and where they put their particles:

- `kalman`, `extended`, `unscented`: one Gaussian; exact for linear models, by derivatives, by sigma points;
- `bootstrap`: particles drawn from the prediction (SIR, Condensation);
- `auxiliary`: parents chosen with regard to the new observation, for all particles or for some; rules set the share by
  the uncertainty of the last posterior;
- `unscented_particle`: every particle proposed from its own unscented Kalman update;
- `dynamics`: how states move, and fixed-lag smoothing for Gaussians and for particles;
- `disturbances`: how large the noises of a linear model were, given all frames.

An object with several features is tracked in two layers:

- `adaptive`: the interface of a layer, and the lower layer: particles of each feature, drawn in a given ratio from the
  upper layer's prediction and from their own;
- `affine`, `perspective`: the upper layer, which estimates the camera's entries and the pose from them, or the pose
  itself;
- `sequential`: the small Kalman filters of both, for compiled loops;
- `agreement`: features that are misplaced, or less exact than their variances;
- `rao_blackwell`: both layers at once; each particle holds all features and an exact camera.

Filters do not see pictures. The likelihood is an argument, a function of states (N, d) that returns log densities (N,).
"""
