import numpy as np
import pytest

from pftrack.core.numerics.random import Purpose, Stream, log_density
from pftrack.filters import adaptive
from pftrack.filters.adaptive import Projection
from pftrack.filters.learning import mixture_em
from pftrack.filters.learning.mixture_em import Mixture, Settings

RNG = np.random.default_rng(0)
ABOVE = (np.array([[2.0, 1.0]]), np.array([[4.0, 9.0]]))
CENTRES = RNG.normal(size=(1, 2, 30)) * [[6.0], [3.0]] + 5.0
POINTS = RNG.normal(size=(1, 2, 40)) * 4.0


def test_eta_settles_at_a_half() -> None:
    """With lambda = 0.5 eta is 1, 2/3, 4/7, ... and tends to 0.5 (eq. A.30)."""
    mixture, etas = mixture_em.begin(1), []
    for _ in range(30):
        mixture = mixture_em.adapt(mixture, POINTS, ABOVE, CENTRES, 5.0, Settings(0.5))
        etas.append(mixture.eta)
    assert etas[:3] == pytest.approx([1, 2 / 3, 4 / 7])
    assert etas[-1] == pytest.approx(0.5)


def test_densities_are_what_they_say() -> None:
    """The Gaussian and the kernel mixture have the densities computed one by one."""
    points, covariance = POINTS[0], np.array([[4.0, 1.5], [1.5, 3.0]])
    ours = mixture_em.gaussian_log_density(points, ABOVE[0][0], covariance)
    assert np.allclose(ours, log_density(points.T, ABOVE[0], covariance))
    each = log_density(points.T[:, None], CENTRES[0].T[None], 25.0 * np.eye(2))
    assert np.allclose(mixture_em.kernel_log_density(points, CENTRES[0], 5.0), np.log(np.exp(each).mean(axis=1)))
    far = mixture_em.kernel_log_density(points + 1e4, CENTRES[0], 5.0)
    assert np.isfinite(far).all()


@pytest.mark.parametrize("density", ["gaussian", "kernel"])
def test_the_first_step_is_the_mean_responsibility(density: str) -> None:
    """In the first frame the ratio becomes the mean share that the upper density has in each survivor."""
    above = np.exp(log_density(POINTS[0].T, ABOVE[0], np.diag(ABOVE[1][0])))
    if density == "kernel":
        below = np.exp(log_density(POINTS[0].T[:, None], CENTRES[0].T[None], 25.0 * np.eye(2))).mean(axis=1)
    else:
        matched = np.cov(CENTRES[0], bias=True) + 25.0 * np.eye(2)
        below = np.exp(log_density(POINTS[0].T, CENTRES[0].mean(axis=1), matched))
    expected = (0.3 * above / (0.3 * above + 0.7 * below)).mean()
    settings = Settings(0.5, 0.0, density)
    ours = mixture_em.adapt(Mixture(np.array([0.3]), np.zeros(1), 0.0), POINTS, ABOVE, CENTRES, 5.0, settings)
    assert ours.ratios[0] == pytest.approx(expected)


def test_saying_nothing_teaches_nothing() -> None:
    """With the exact density an observation that says nothing leaves the ratio as it is on average (a martingale)."""
    features, count = 6000, 50
    rng = Stream(1, 1, Purpose.TRACK)
    before = adaptive.begin(np.zeros((features, 2)), 4.0, count, Stream(1, 0, Purpose.START))
    means = np.zeros((features, 2, 2)) + 3.0
    projection = Projection(means, np.broadcast_to(9.0 * np.eye(2), (features, 2, 2, 2)).copy())
    for ratio in (0.3, 0.5, 0.8):
        ratios = np.full(features, ratio)
        cloud = adaptive.draw(before, projection, ratios, 5.0, count, rng)
        after = adaptive.weigh(cloud, np.zeros((features, count)), rng)
        mixture = mixture_em.adapt(
            Mixture(ratios, ratios, 0.0),
            adaptive.surviving(after),
            (projection.positions, projection.variances),
            adaptive.propagate(before),
            5.0,
            Settings(0.5, 0.0, "kernel"),
        )
        error = mixture.responsibilities.std() / np.sqrt(features)
        assert mixture.responsibilities.mean() == pytest.approx(ratio, abs=4 * error)


@pytest.mark.parametrize(("offset", "expected"), [(0.0, 0.9), (1000.0, 0.1)])
@pytest.mark.parametrize("density", ["gaussian", "kernel"])
def test_clear_cases_go_to_the_clip(offset: float, expected: float, density: str) -> None:
    """When all survivors come from one of two far predictions, the ratio goes to the clip on its side and stays."""
    survivors = ABOVE[0][:, :, None] + RNG.normal(size=(1, 2, 50)) + offset
    centres = ABOVE[0][:, :, None] + RNG.normal(size=(1, 2, 50)) + 1000.0
    mixture = mixture_em.begin(1)
    for _ in range(10):
        mixture = mixture_em.adapt(mixture, survivors, ABOVE, centres, 5.0, Settings(0.5, 0.1, density))
    assert mixture.ratios[0] == pytest.approx(expected)
