"""Fitting: noises and sharpnesses that a recording supports, found by what filters say of it.

A filter that has seen the frames up to t - 1 says how probable frame t is. The product of these numbers over a
recording is the evidence of its settings, p(z_{1:T} | settings), and settings that make it large are those under which
the recording is least surprising (Särkkä 2013, chapter 12).

- `search`: golden section for one number, a simplex for several, on logarithms; expectation maximisation where the
  model is linear and its noise Gaussian;
- `found`: trials on what one run has seen, and the fit. It uses the first half of a run, every trial with the same
  random numbers, so that two settings differ by what they are and not by luck. What it finds is kept only if it is
  better on the second half, with other random numbers.
"""

from pftrack.analysis.fitting.found import MOST_NUMBERS, Fit, FitError, Fitted, Half, Method, Score, fit, fittable

__all__ = ["MOST_NUMBERS", "Fit", "FitError", "Fitted", "Half", "Method", "Score", "fit", "fittable"]
