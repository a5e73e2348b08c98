"""Filters: from the posterior of one frame to the posterior of the next.

A Bayesian filter repeats two things: predict the state by the dynamics, then weigh the prediction by what is observed.
The members differ in how they represent the posterior and where they put their particles:

- `kalman`, `extended`, `unscented`: one Gaussian; exact for linear models, by derivatives, by sigma points;
- `bootstrap`: particles drawn from the prediction (SIR, Condensation);
- `auxiliary`: parents chosen with regard to the new observation, for all particles or for some;
- `unscented_particle`: every particle proposed from its own unscented Kalman update;
- `switching`: rules that choose between prediction and observation by how uncertain the last posterior was;
- `fixed_lag`: the state a few frames ago, given what has been seen since, for Gaussians and for particles.

Filters know no pictures: the likelihood is an argument, a function of states (N, d) that returns log densities (N,).
"""

from pftrack.filters import auxiliary, bootstrap, extended, fixed_lag, kalman, switching, unscented, unscented_particle
from pftrack.filters.posterior import LogLikelihood, Posterior

__all__ = [
    "LogLikelihood",
    "Posterior",
    "auxiliary",
    "bootstrap",
    "extended",
    "fixed_lag",
    "kalman",
    "switching",
    "unscented",
    "unscented_particle",
]
