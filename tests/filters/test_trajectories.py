"""Filters of trajectories: one against the general Kalman filter, particles against it, and each track for itself."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.trajectories.scene import REFERENCE_PX, TRUE_PATH
from pftrack.filters import kalman
from pftrack.filters.dynamics import autoregression
from pftrack.filters.trajectories import cloud, gaussian
from pftrack.filters.trajectories.gaussian import locate, logs_mode
from pftrack.filters.trajectories.whole import Method, Settings, beginnings, follow, likelihood_surface

TRACK = REFERENCE_PX.copy()  # for what can be written, as a run's tracks can, functions are compiled before
OUTLIERS = (15, 30, 45, 60, 75, 90)
DOCUMENT = Settings(10.0, 1.0)


def clean() -> np.ndarray:
    """The reference track without its outliers."""
    track = TRACK.copy()
    track[list(OUTLIERS), 0] = TRUE_PATH[list(OUTLIERS), 0]
    return track


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square difference of coordinates."""
    return float(np.sqrt(np.square(one - other).mean()))


def test_the_linear_filter_is_the_general_one() -> None:
    """Positions, variances and densities are those of the Kalman filter over all four coordinates, gaps included."""
    track = TRACK[:30].copy()
    track[[7, 8]] = np.nan
    model = autoregression(2.0 * np.eye(2), -np.eye(2), np.zeros(2), np.eye(2))
    belief = Gaussian(np.tile(track[0], 2), np.eye(4))
    ours, total = gaussian.nothing(1), 0.0
    for observed in track:
        ours, densities = gaussian.step(ours, observed[None], np.full(1, 10.0), np.ones(1), lag=25)
        belief, density = kalman.predict(belief, model), 0.0
        if np.isfinite(observed).all():
            belief, density = kalman.update(belief, observed, np.eye(2, 4), 10.0 * np.eye(2))
        assert densities[0] == pytest.approx(density)
        np.testing.assert_allclose(ours.means[0, 0].T.ravel(), belief.mean)
        np.testing.assert_allclose(ours.covariances[0, 0], belief.covariance[[0, 0, 2], [0, 2, 2]])
        total += density
    assert follow("lg", track[:, None], DOCUMENT).log_likelihoods[0] == pytest.approx(total)


def test_the_smoother_is_the_least_squares_solution() -> None:
    """With all frames within the lag it is the mean of the joint Gaussian of all positions."""
    track, all_places = TRACK[:20], np.eye(22)  # -2, -1, 0, ...; the first two are the beginning
    curvature = all_places[:-2] - 2.0 * all_places[1:-1] + all_places[2:]
    rows = np.concatenate([curvature, all_places[2:], all_places[:2]])
    values = np.concatenate([np.zeros((20, 2)), track, track[[0, 0]]])
    root = np.sqrt(np.repeat([1.0, 0.1, 1.0], [20, 20, 2]))[:, None]
    exact = np.linalg.lstsq(root * rows, root * values, rcond=None)[0][2:]
    found = follow("lg", track[:, None], replace(DOCUMENT, lag=50))
    np.testing.assert_allclose(found.smoothed[:, 0], exact, rtol=1e-9)


def test_the_likelihood_surface_is_that_of_the_filter() -> None:
    """A cell of the grid of 20 by 20 is the log likelihood of the filter, also of a track that begins late."""
    surface = likelihood_surface("lg", TRACK, Settings())
    assert surface[9, 0] == pytest.approx(follow("lg", TRACK[:, None], DOCUMENT).log_likelihoods[0])
    late = np.concatenate([np.full((3, 2), np.nan), TRACK])
    assert likelihood_surface("lg", late, Settings())[9, 0] == pytest.approx(surface[9, 0])


@pytest.mark.parametrize(("count", "filtered", "smoothed"), [(500, 0.21, 0.58), (2000, 0.11, 0.36)])
def test_particles_agree_with_the_exact_answer(count: int, filtered: float, smoothed: float) -> None:
    """Under Gaussian noise and without outliers, means of particles are near the Kalman filter's, nearer the more."""
    track = np.repeat(clean()[:, None], 4, axis=1)
    exact = follow("lg", clean()[:, None], DOCUMENT)
    found = follow("mcf-gaussian", track, replace(DOCUMENT, count=count, by_mode=False))
    assert apart(found.filtered, exact.filtered) < filtered
    assert apart(found.smoothed, exact.smoothed) < smoothed
    assert found.log_likelihoods.mean() == pytest.approx(exact.log_likelihoods[0], abs=2.0)


@pytest.mark.parametrize("method", ["lg", "nlng"])
def test_a_track_does_not_know_of_the_others(method: Method) -> None:
    """Its numbers are the same to the bit alone, in another place of the batch, and while others begin late or end."""
    settings, track = Settings(count=50), TRACK[:12, None]
    every = np.concatenate([np.full((12, 3, 2), np.nan), track], axis=1)
    every[4:8, :3] = 300.0
    alone = follow(method, track, settings, numbers=np.array([7]))
    together = follow(method, every, settings, numbers=np.array([1, 2, 3, 7], np.int64))
    np.testing.assert_array_equal(together.filtered[:, 3:], alone.filtered)
    np.testing.assert_array_equal(together.smoothed[:, 3:], alone.smoothed)
    assert np.isnan(together.filtered[:4, :3]).all()
    assert np.isfinite(together.filtered[4:]).all()


def test_the_tree_is_the_whole_past_of_the_particles() -> None:
    """Shares of all ages sum to one, and a ring of paths that is drawn again with the particles has the same means."""
    belief, observed = cloud.nothing(1), TRACK[:20]
    law = cloud.Law(np.ones(1), np.ones(1))
    paths: np.ndarray | None = None
    for frame, seen in enumerate(observed):
        start, how = beginnings(belief, seen[None], 1.0), {"count": 200, "lag": 8, "by_mode": False}
        belief, moments = cloud.step(belief, seen[None], law, start, numbers=np.arange(1), stream=(3, frame, 1), **how)
        states, shares = belief.age(0, 0)
        older = belief.age(0, 1)[0][belief.parents[slice(*belief.offsets[0, :2])]][:, None]
        if paths is not None:  # each node of today came from a path whose newest position is its parent's
            older = paths[[int(np.flatnonzero((paths[:, 0] == one).all(axis=1))[0]) for (one,) in older]]
        paths = np.concatenate([states[:, None], older], axis=1)[:, :9]
        for age in range(min(frame + 1, 9)):
            np.testing.assert_allclose(moments.past[age, 0], shares @ paths[:, age], rtol=1e-6)
            assert belief.age(0, age)[1].sum() == pytest.approx(1.0)
    assert sum(array.nbytes for array in belief.arrays) < 200 * 9 * 2 * 4


def test_without_drift_laws_are_only_chosen() -> None:
    """Every log sigma^2 and log tau^2 of the end was there at the start; with drift they are new."""
    laws = []
    for length, drift in ((1, 0.0), (10, 0.0), (10, 0.1)):
        last = follow("nlng", TRACK[:length, None], Settings(count=100, drift=drift)).last
        laws.append({tuple(law) for law in last.laws(0)[0]})
    known, chosen, new = laws
    assert chosen < known
    assert not new & known


def test_a_mode_is_the_mean_about_the_fullest_bin() -> None:
    """Bins begin at whole numbers, below 0 too; what is further than one bin away does not count."""
    nodes = np.array([[0.2, 0.2], [0.4, 0.9], [1.5, 0.5], [-0.5, 0.1], [40.0, 40.0], [2.5, 0.0]], np.float32)
    counts = np.array([2, 1, 1, 2, 2, 9], np.uint16)
    middle = (0.4 + 0.4 + 1.5 - 1.0) / 6, (0.4 + 0.9 + 0.5 + 0.2) / 6
    assert locate(nodes[:5], counts[:5], True) == pytest.approx(middle)
    assert locate(nodes, counts, True)[0] == pytest.approx((1.5 + 9 * 2.5) / 10)
    assert locate(nodes, counts, False)[0] == pytest.approx(float(nodes[:, 0] @ counts) / 17)
    assert logs_mode(np.array([0.0, 0.1, 0.3, 2.0]), np.array([1.0, 1.0, 1.0, 1.5])) == pytest.approx(0.4 / 3)
    assert logs_mode(np.array([0.0, 0.1, 0.3, 2.0]), np.array([0.1, 0.1, 0.1, 1.5])) == pytest.approx(2.0)
