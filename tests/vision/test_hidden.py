"""Features that may be hidden: what is covered says nothing, and what only moves fast is not taken for covered."""

import numpy as np
import pytest

from pftrack.vision.likelihoods.points import compare, log_fits, mix_hidden

EXPECTED = np.array([[10.0 * index, 5.0] for index in range(6)])
N = 40


def cloud(off_px: float = 0.0) -> np.ndarray:
    """Particles around where features are expected, the first of each at a distance from there."""
    drawn = np.random.default_rng(1).normal(0.0, 3.0, (6, N, 2))
    drawn[:, 0] = (off_px, 0.0)
    return EXPECTED[:, None] + drawn


def likelihoods(**poor: float) -> np.ndarray:
    """Each feature is at its first particle, and nowhere else; some fit poorly."""
    made = np.full((6, N), -30.0)
    made[:, 0] = 0.0
    for name, value in poor.items():
        made[int(name[-1]), 0] = value
    return made


def test_the_mixture_is_the_one_that_is_written_down() -> None:
    """Seen with weight 1, hidden with the odds, in which every particle is as likely as the mean of all."""
    given = likelihoods(feature_2=-4.0)
    mixed, hidden = mix_hidden(given, cloud(), EXPECTED, 0.2, 3.0)
    odds = 0.2 * np.exp(-given[:, 0])
    assert hidden == pytest.approx(odds / (1 + odds))
    level = odds * np.exp(given).mean(axis=1) / np.exp(given[:, 0])
    assert np.exp(mixed - given[:, :1]) == pytest.approx(np.exp(given - given[:, :1]) + level[:, None])


def test_what_all_features_share_says_nothing() -> None:
    """In bad light all fit worse, and none is hidden for that."""
    given, darker = likelihoods(feature_3=-3.0), likelihoods(feature_3=-3.0) - 8.0
    (_, hidden), (_, same) = (mix_hidden(each, cloud(), EXPECTED, 0.25, 3.0) for each in (given, darker))
    assert same == pytest.approx(hidden)


def test_a_head_that_jumps_is_not_covered() -> None:
    """Where the features that fit are far from where they were expected, a bad fit does not show a cover."""
    given = likelihoods(feature_0=-3.0)
    shares = [mix_hidden(given, cloud(off), EXPECTED, 0.25, 3.0)[1][0] for off in (0.0, 3.0, 9.0)]
    assert shares[0] > shares[1] > shares[2]
    assert shares[0] > 0.8
    assert shares[2] < 0.1


def test_nan_is_a_bad_fit() -> None:
    """A particle outside of the picture, whose likelihood is NaN, does not fit."""
    given = likelihoods()
    given[5] = np.nan
    mixed, hidden = mix_hidden(given, cloud(), EXPECTED, 0.25, 3.0)
    assert np.isfinite(mixed).all()
    assert hidden[5] == pytest.approx(1.0)
    assert np.ptp(mixed[5]) == pytest.approx(0.0)


def test_a_feature_fits_where_its_best_particle_is_near() -> None:
    """The t distribution around where a pose has a feature, of half the slack, weighs each particle."""
    given, at = likelihoods(feature_2=-4.0), cloud(off_px=6.0)
    fits = log_fits(given, at, EXPECTED, 8.0)
    off = np.square(at - EXPECTED[:, None]).sum(axis=2)
    assert fits == pytest.approx((given - 2.0 * np.log(1.0 + off / (2.0 * 4.0**2))).max(axis=1))
    assert fits[0] == pytest.approx(-2.0 * np.log(1.0 + 36.0 / 32.0))
    assert np.isfinite(log_fits(np.full_like(given, np.nan), at, EXPECTED, 8.0)).all()


def test_poses_are_compared_by_what_is_seen() -> None:
    """Features that fit neither pose say nothing; one that fits only one says as much as it is better than hidden."""
    both = np.array([0.0, 0.0, 0.0, -30.0, -40.0])
    assert compare(both, np.array([0.0, 0.0, 0.0, -40.0, -20.0])) == pytest.approx(0.0, abs=1e-6)
    one = np.array([0.0, 0.0, 0.0, 0.0, -40.0])
    assert compare(one, both) == pytest.approx(np.log(1.0 + np.exp(3.0)), abs=1e-6)
    assert compare(both, one) == -compare(one, both)
