"""Filters: from the posterior of one frame to the posterior of the next.

A Bayesian filter repeats two things: predict the state by the dynamics, then weigh the prediction by what is observed.
The members differ in how they represent the posterior and where they put their particles:

- `kalman`, `extended`, `unscented`: one Gaussian; exact for linear models, by derivatives, by sigma points;
- `bootstrap`: particles drawn from the prediction (SIR, Condensation);
- `auxiliary`: parents chosen with regard to the new observation, for all particles or for some, as rules say that look
  at how uncertain the last posterior was;
- `unscented_particle`: every particle proposed from its own unscented Kalman update;
- `dynamics`: how states move; and the state a few frames ago, given what has been seen since, for Gaussians and for
  particles;
- `disturbances`: how large the noises of a linear model were, given all frames.

An object with several features is tracked in two layers:

- `adaptive`: what a layer is; below, particles of each feature, drawn in a given ratio from the upper prediction and
  from their own;
- `affine`, `perspective`: above, the camera's entries and the pose from them, or the pose itself;
- `sequential`: the small Kalman filters of both, for compiled loops;
- `agreement`: features that are elsewhere, or less exact than they say;
- `rao_blackwell`: both layers at once, particles of all features together and an exact camera for each of them.

Filters know no pictures: the likelihood is an argument, a function of states (N, d) that returns log densities (N,).
"""
