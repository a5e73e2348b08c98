"""Lesson 8's closed forms against integrals and draws."""

import math

import numpy as np
import pytest

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.teaching.lessons.course.importance import MEAN, SD, Proposal
from pftrack.teaching.lessons.course.probability import normal

PROPOSALS = [Proposal(0.0, 1.0), Proposal(0.0, 2.0), Proposal(-1.0, 0.8), Proposal(MEAN, SD)]


@pytest.mark.parametrize("proposal", PROPOSALS)
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_moments_of_the_weight_are_integrals(proposal: Proposal, order: int) -> None:
    """E_q[(p/q)^k] is the integral of p^k / q^(k - 1)."""
    x = np.linspace(-12.0, 14.0, 200_001)
    p, q = normal(x, MEAN, SD), normal(x, proposal.centre, proposal.spread)
    with np.errstate(divide="ignore", invalid="ignore"):
        integrand = np.where(p > 0, p * (p / q) ** (order - 1), 0.0)
    assert proposal.moment(order) == pytest.approx(np.trapezoid(integrand, x), rel=1e-9)


def test_a_proposal_that_is_too_narrow_has_no_effective_share() -> None:
    """Below p's standard deviation over the root of 2 the weights' variance is infinite, and nothing is promised."""
    assert math.isfinite(Proposal(0.0, 0.36).moment(2))
    for narrow in (Proposal(0.0, 0.35), Proposal(-3.0, 0.2)):
        assert narrow.share == 0.0
        assert narrow.share_sd(5000) is None
        assert narrow.mean_sd(5000) is None


@pytest.mark.parametrize(
    ("proposal", "count"), [(Proposal(0.0, 1.0), 200), (Proposal(0.0, 2.0), 200), (Proposal(4.0, 4.0), 500)]
)
def test_the_scatter_is_as_it_is_said_to_be(proposal: Proposal, count: int) -> None:
    """The standard deviations of share and mean are those of repeated draws, within 15 %."""
    clouds = [proposal.draw(Stream(3, repeat, Purpose.TRACK), count) for repeat in range(400)]
    shares = np.array([cloud.effective_sample_size for cloud in clouds]) / count
    means = np.array([cloud.weights @ cloud.states[:, 0] for cloud in clouds])
    assert shares.std() == pytest.approx(proposal.share_sd(count), rel=0.15)
    assert means.std() == pytest.approx(proposal.mean_sd(count), rel=0.15)
