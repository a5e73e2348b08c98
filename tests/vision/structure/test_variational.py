"""Factorization by variational Bayes, of all frames at once and frame by frame."""

import numpy as np
import pytest

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.vision.structure import variational
from pftrack.vision.structure.factorization import Tracks, shape_error
from pftrack.vision.structure.variational import GAMMA, Initial, Settings, Variational, moments, posterior_points
from tests.vision.structure.bodies import body, cameras, seen

BODY = body()
SD = 10.0 ** np.random.default_rng(3).uniform(-0.5, 1.5, (20, 9))
NOISY = seen(BODY, cameras(), SD, noise=1.0)
INITIAL: tuple[Initial, ...] = ("svd", "zero", "random")


def fitted(tracks: Tracks = NOISY, iterations: int = 10, initial: Initial = "svd") -> Variational:
    return variational.fit(tracks, iterations=iterations, initial=initial, rng=Stream(0, 0, Purpose.START))


def energy(tracks: Tracks, found: Variational) -> float:
    logs = np.array([-np.linalg.slogdet(one)[1] for one in found.motion_covariances])
    shape, motion = (found.shape, found.shape_covariances), (found.motion, found.motion_covariances)
    return variational.free_energy((tracks.matrix, tracks.precisions), shape, motion, logs, GAMMA, 0)


def test_the_information_form_is_the_gain_form() -> None:
    """The points' beliefs agree with the gain form of Bando 2007, eq. 4.13 as corrected, to 1e-9."""
    found = fitted()
    rows, precisions = NOISY.matrix, NOISY.precisions
    means, covariances = posterior_points((rows, precisions), (found.motion, found.motion_covariances))
    slopes = found.motion[:, :3]
    for n in range(len(BODY)):
        xi = np.diag([1.0, 1.0, 1.0, 0.0]) + np.einsum("d,dij->ij", precisions[:, n], found.motion_covariances)
        prior = np.linalg.inv(xi[:3, :3])
        expected = -prior @ xi[:3, 3]
        spread = np.diag(1.0 / precisions[:, n]) + slopes @ prior @ slopes.T
        gain = prior @ slopes.T @ np.linalg.inv(spread)
        innovation = rows[:, n] - found.motion @ np.append(expected, 1.0)
        assert np.abs(means[n] - expected - gain @ innovation).max() < 1e-9
        assert np.abs(covariances[n] - (np.eye(3) - gain @ slopes) @ prior).max() < 1e-9


def test_rows_are_a_regression_on_the_points() -> None:
    """The rows' beliefs are those of Bayesian regression with the moments of the points."""
    found = fitted()
    second = moments(found.shape, found.shape_covariances)
    (means, covariances), logs = variational.posterior_rows((NOISY.matrix, NOISY.precisions), second, GAMMA, 0)
    for d in (0, 2, 3, 17):
        weights = NOISY.precisions[d]
        precision = GAMMA * np.eye(4) + np.einsum("n,nij->ij", weights, second)
        prior = GAMMA * np.eye(40)[d, :4]
        wanted = prior + np.einsum("n,n,ni->i", weights, NOISY.matrix[d], second[:, 3])
        assert np.allclose(means[d], np.linalg.solve(precision, wanted))
        assert np.allclose(covariances[d], np.linalg.inv(precision))
        assert logs[d] == pytest.approx(np.linalg.slogdet(precision)[1])


def test_the_free_energy_is_that_of_the_document() -> None:
    """Computed as printed, with corrections C14 to C18, it is the same number."""
    found = fitted()
    rows, precisions = NOISY.matrix, NOISY.precisions
    height, count = rows.shape
    second = moments(found.shape, found.shape_covariances)
    likelihood = -count * (3 + height) / 2 * np.log(2 * np.pi)
    for n in range(count):
        weights = precisions[:, n]
        weighted = np.einsum("d,di,dj->ij", weights, found.motion, found.motion)
        weighted += np.einsum("d,dij->ij", weights, found.motion_covariances)
        likelihood += -0.5 * (found.shape[n] @ found.shape[n] + np.trace(found.shape_covariances[n]))
        likelihood += 0.5 * np.log(weights).sum() - 0.5 * (weights * rows[:, n] ** 2).sum()
        likelihood += (weights * rows[:, n] * (found.motion @ second[n, 3])).sum()
        likelihood -= 0.5 * np.trace(second[n] @ weighted)
    entropy = -1.5 * count * (1 + np.log(2 * np.pi)) - 0.5 * np.linalg.slogdet(found.shape_covariances)[1].sum()
    away = found.motion - np.eye(height)[:, :4]
    motion = 0.5 * GAMMA * (away**2).sum() - 2.0 * height * (1 + np.log(GAMMA))
    motion += -0.5 * np.linalg.slogdet(found.motion_covariances)[1].sum()
    motion += 0.5 * GAMMA * np.trace(found.motion_covariances, axis1=1, axis2=2).sum()
    assert energy(NOISY, found) == pytest.approx(likelihood - entropy - motion, rel=1e-12)
    assert found.free_energies[-1] == pytest.approx(energy(NOISY, found), rel=1e-12)


@pytest.mark.parametrize("initial", INITIAL)
def test_the_free_energy_never_falls(initial: Initial) -> None:
    """Over forty passes from each beginning, and with points that are not seen at times, to 1e-8 of it."""
    sd = np.where(np.random.default_rng(4).uniform(size=SD.shape) < 0.2, np.inf, SD)
    for tracks in (NOISY, seen(BODY, cameras(), sd, noise=1.0)):
        energies = fitted(tracks, 40, initial).free_energies
        assert (np.diff(energies) >= -1e-8 * np.abs(energies[1:])).all()


@pytest.mark.parametrize("initial", INITIAL)
def test_noise_free_tracks_are_recovered(initial: Initial) -> None:
    """From nearly noise-free tracks the shape comes back to 1e-8, whatever the beginning."""
    tracks = seen(BODY, cameras(), 1e-5)
    assert shape_error(fitted(tracks, 60, initial).shape, BODY) < 1e-8


def test_missing_positions_are_a_matter_of_noise() -> None:
    """With some positions unseen the shape comes back all the same; infinite and huge variances are alike."""
    missing = np.random.default_rng(5).uniform(size=(20, 9)) < 0.05
    for unseen in (np.inf, 1e6):
        shape = fitted(seen(BODY, cameras(), np.where(missing, unseen, 0.01)), 50).shape
        assert shape_error(shape, BODY) < 1e-6


def test_a_point_that_was_never_seen_keeps_its_prior() -> None:
    """Its belief is N(0, I)."""
    sd = np.where(np.arange(9) == 4, np.inf, np.ones((20, 9)))
    found = fitted(seen(BODY, cameras(), sd, noise=1.0))
    assert np.allclose(found.shape[4], 0.0)
    assert np.allclose(found.shape_covariances[4], np.eye(3))
    assert np.isfinite(found.free_energies).all()


def test_depth_that_was_not_seen_shows() -> None:
    """Without rotation, and for a flat body, the third strength is that of noise; otherwise it is far above."""
    still = np.tile(cameras(1), (20, 1))
    assert fitted(iterations=30).strengths[2] > 3.0
    for tracks in (seen(BODY, still, 1.0, noise=1.0), seen(BODY * [1.0, 1.0, 0.0], cameras(), 1.0, noise=1.0)):
        assert fitted(tracks, 30).strengths[2] < 1.2


def test_the_metric_shape_is_in_px() -> None:
    """From noise-free tracks the metric shape has the distances of the body, and positions are the same as before."""
    tracks = seen(BODY, cameras(), 1e-5)
    found = fitted(tracks, 60)
    upgraded = variational.metric(found)
    centred = upgraded.shape - upgraded.shape.mean(axis=0)
    truth = BODY - BODY.mean(axis=0)
    assert np.abs(centred @ centred.T - truth @ truth.T).max() < 1e-6 * (truth**2).sum()
    assert np.allclose(upgraded.motion @ np.column_stack([upgraded.shape, np.ones(9)]).T, tracks.matrix, atol=1e-3)
    spread = np.einsum("di,nij,dj->dn", found.motion[:, :3], found.shape_covariances, found.motion[:, :3])
    mapped = np.einsum("di,nij,dj->dn", upgraded.motion[:, :3], upgraded.shape_covariances, upgraded.motion[:, :3])
    assert np.allclose(spread, mapped)


# Factorization frame by frame: forgetting, the window, and what is published (Bando 2007, ch. 4 section 5.2).

SHORT = Settings(window=12)


def test_eta_settles_at_a_half() -> None:
    """With lambda = 0.5 eta is 1, 2/3, 4/7, ... and tends to 0.5, for all points alike."""
    states = variational.run(seen(BODY, cameras(40)), SHORT)
    etas = np.array([state.eta for state in states if state.full])
    assert [*etas[:3, 0], *etas[-1]] == pytest.approx([1.0, 2 / 3, 4 / 7, *[0.5] * 9])
    assert [state.common_eta for state in states if state.full] == pytest.approx(etas[:, 0])


def test_the_first_full_window_is_the_batch() -> None:
    """Until the window is full nothing is known; then it is what ten passes over these frames give."""
    tracks = seen(BODY, cameras(14), 1.0, noise=1.0)
    states = variational.run(tracks, SHORT)
    assert [state.full for state in states[9:13]] == [False, False, True, True]
    assert (states[10].shape.any(), states[10].published) == (False, None)
    assert np.isnan(states[10].free_energy)
    whole = variational.fit(Tracks(tracks.positions[:12], tracks.variances[:12]))
    assert np.array_equal(states[11].shape, whole.shape)
    assert np.allclose(states[11].shape_covariances, whole.shape_covariances)
    assert states[11].free_energy == whole.free_energies[-1]


def test_what_is_published_is_the_best_so_far() -> None:
    """The published shape is that of the step with the greatest average free energy."""
    states = [s for s in variational.run(seen(BODY, cameras(40), 1.0, noise=1.0), SHORT) if s.full]
    best = int(np.argmax([state.average_energy for state in states]))
    assert states[-1].best_energy == states[best].average_energy
    assert np.array_equal(states[-1].published, states[best].shape)
