"""The orders that Bando claims for the prism, on few trials; the figures are with those of all studies."""

from functools import cache

import numpy as np

from pftrack.reproduce.prism import Method, Trial, TrialResult, run_trial


@cache
def course(method: Method, seed: int) -> TrialResult:
    return run_trial(Trial(method, seed))


def test_methods_see_the_same_prism() -> None:
    """A trial is reproducible, and a course has what its method has."""
    first, again = course("alpha-1", 3), run_trial(Trial("alpha-1", 3))
    assert np.array_equal(first.errors_deg, again.errors_deg)
    assert first.ratio_front == 1.0
    pinhole = run_trial(Trial("alpha-1", 3, {"upper_layer": "perspective"}))
    assert (pinhole.translation_mm[:2] < first.translation_mm[:2]).all()


def test_the_mixture_is_best() -> None:
    """Over three trials the mixture is at least 0.1 degrees below the upper prediction, which is below the lower."""
    methods: tuple[Method, ...] = ("pf-asd", "alpha-1", "alpha-0")
    mixture, upper, lower = (np.mean([course(it, seed).error_deg for seed in range(3)]) for it in methods)
    assert mixture + 0.1 <= upper < lower


def test_the_ratio_rises_over_tens_of_frames_while_a_vertex_is_hidden() -> None:
    """Hidden vertices are drawn from above more often, by a ramp of 20 to 40 frames rather than a step."""
    courses = [course("pf-asd", seed) for seed in range(3)]
    assert np.mean([one.ratio_hidden - one.ratio_visible for one in courses]) > 0.15
    ramp = np.mean([one.ramp for one in courses], axis=0)
    assert ramp[4] < 0.3
    assert ramp[19] < ramp[39] < ramp[59]
    assert ramp[39] > 0.6
