"""Features in layers, and two filters of a solid, one of them doubting features."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.prism.scene import VERTICES_MM, PrismParameters, sight
from pftrack.experiments.shared.pose import layered
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered, Rival, Settings
from pftrack.filters import adaptive
from pftrack.filters.affine import AffineLayer
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.vision.likelihoods import points

SCENE = PrismParameters()
AFFINE = AffineLayer(VERTICES_MM, np.array([[5.0, 0, 0, 0], [0, 5.0, 0, 0]]))


def rng(frame: int, seed: int = 0) -> Stream:
    return Stream(seed, frame, Purpose.TRACK)


def test_a_hidden_feature_is_where_the_solid_has_it() -> None:
    """The ratio of a feature that fits nothing rises to how surely it is hidden; those of the others are as learned."""
    settings, covered, random, now = Settings(hidden_weight=0.25), 3, rng(1), sight(0, 1, SCENE)
    start = Stream(0, 0, Purpose.START)
    state = layered.begin(AFFINE, AFFINE.begin(), sight(0, 0, SCENE).true_px, settings, start)
    proposed = layered.propose(state, AFFINE, settings, random)
    scores = points.log_likelihood(proposed.drawn.positions, now.points_px, now.noise_sd_px)
    scores[covered] = scores.max() - 20.0 + 0.01 * scores[covered]
    found = layered.conclude(state, proposed, AFFINE, scores, settings, random)
    survivors, learning = adaptive.surviving(found.features), layered.mixture_em.Settings()
    projected, own = (proposed.projection.positions, proposed.projection.variances), adaptive.propagate(state.features)
    ratios = layered.mixture_em.adapt(state.mixture, survivors, projected, own, settings.noise_sd_px, learning).ratios
    assert found.hidden[covered] > 0.99
    assert np.delete(found.hidden, covered).max() < 0.5
    most = 1.0 - learning.clip
    assert ratios[covered] < 0.6 < most
    assert np.array_equal(found.mixture.ratios, np.maximum(ratios, np.minimum(found.hidden, most)))


# Two filters of a solid, one of them doubting features: the pictures decide which is believed.

FOCAL_PX, PLACE_MM = 400.0, np.array([0.0, 0.0, 80.0])
LAYER = PerspectiveLayer(VERTICES_MM, FOCAL_PX, np.concatenate([np.zeros(3), PLACE_MM]))
SETTINGS = Settings(slack_px=8.0, hidden_weight=0.5)


def seen(yaw_rad: float) -> NDArray[np.float64]:
    return pinhole(VERTICES_MM @ rotation(np.array([0.0, yaw_rad, 0.0])).T + PLACE_MM, FOCAL_PX)


def likelihood(at: NDArray[np.float64], covered: int = 0) -> FeatureLikelihood:
    """Each feature looks like itself within a few pixels of its place; the first ones, covered, like it nowhere."""
    lost = np.arange(len(at))[:, None] < covered

    def score(positions: NDArray[np.float64]) -> NDArray[np.float64]:
        fits = np.maximum(-0.5 * np.square(positions - at[:, None]).sum(axis=2) / 9.0, -30.0)
        return np.where(lost, -20.0 + 1e-3 * positions[:, :, 0], fits)

    return score


def hypotheses_begun() -> Layered:
    return layered.begin(LAYER, LAYER.begin(), seen(0.0), SETTINGS, Stream(3, 0, Purpose.START))


def rivals(
    believed: Layered, rival: Rival | None, score: FeatureLikelihood, frame: int = 1, settings: Settings = SETTINGS
) -> tuple[Layered, Rival]:
    """Take a frame that looks the same to both filters."""
    return layered.step_rivals(believed, rival, LAYER, (score, score), settings, rng(frame, 3))


def follow(scores: list[FeatureLikelihood]) -> list[tuple[Layered, Rival]]:
    believed, rival, found = hypotheses_begun(), None, []
    for frame, score in enumerate(scores, 1):
        believed, rival = rivals(believed, rival, score, frame)
        found.append((believed, rival))
    return found


STILL = likelihood(seen(0.0))


def test_at_first_features_may_be_hidden() -> None:
    """Nothing tells the two apart yet; the filter that doubts is believed, and both begin from the same state."""
    ((believed, rival),) = follow([STILL])
    assert not rival.doubting
    assert believed.hidden.min() > 0.0
    assert not rival.layers.hidden.any()
    assert abs(rival.log_odds) < layered.CLEAR


def test_a_cover_is_doubted() -> None:
    """While five of eight corners are covered, the filter that takes them for hidden is believed; the pose stays."""
    found = follow([STILL] * 5 + [likelihood(seen(0.0), covered=5)] * 20)
    assert not any(rival.doubting for _, rival in found[6:])
    assert found[-1][0].hidden[:5].min() > 0.9
    assert np.abs(np.rad2deg([believed.pose.mean for believed, _ in found])).max() < 5.0


def test_a_solid_that_turns_is_followed() -> None:
    """Whichever filter follows a turn of sixty degrees within ten frames is believed: the pose is never far behind."""
    turn = np.concatenate([np.zeros(3), np.linspace(0.0, np.pi / 3.0, 10), np.full(5, np.pi / 3.0)])
    found = follow([likelihood(seen(yaw)) for yaw in turn])
    off = np.rad2deg([believed.pose.mean[1] for believed, _ in found] - turn)
    assert np.abs(off).max() < 15.0
    assert np.abs(off[-3:]).max() < 5.0


@pytest.mark.parametrize(
    ("odds", "doubting", "after"),
    [(-1.0, False, True), (-3.0, False, False), (-1.0, True, False), (1.0, True, True), (-12.0, True, False)],
    ids=["doubts stay", "doubts are given up", "trust stays", "trust is given up", "a fifth is forgotten"],
)
def test_who_is_believed_changes_only_where_it_is_clear(odds: float, *, doubting: bool, after: bool) -> None:
    """Two filters that are alike add nothing to the odds, so what was known decides, discounted."""
    settings = replace(SETTINGS, hidden_weight=1e-12, sample_count=400)
    rival = Rival(hypotheses_begun(), doubting=doubting, log_odds=odds / 0.8)
    one, other = rivals(hypotheses_begun(), rival, STILL, settings=settings)
    assert other.log_odds == pytest.approx(odds, abs=0.5)
    assert other.doubting != after
    assert bool(one.hidden.any()) == after


@pytest.mark.parametrize("takes_over", [False, True])
def test_of_particles_that_were_not_believed_none_descends(*, takes_over: bool) -> None:
    """A filter that stays has particles from its own in the last frame; one that takes over begins all lines anew."""
    believed, rival = follow([STILL] * 8)[-1]
    odds = 8.0 if rival.doubting == takes_over else -8.0
    after, other = rivals(believed, replace(rival, log_odds=odds), STILL, 9)
    assert (other.doubting != rival.doubting) == takes_over
    assert (after.features.parents >= 0).any() != takes_over
    assert (other.layers.features.parents >= 0).any()


@pytest.mark.parametrize("odds", [40.0, -40.0])
def test_one_that_is_far_behind_begins_again(odds: float) -> None:
    """It is then where the other is, and nothing is held against it."""
    best, behind = rivals(hypotheses_begun(), Rival(hypotheses_begun(), doubting=odds < 0.0, log_odds=odds), STILL)
    assert behind.layers is best
    assert (behind.log_odds, behind.doubting) == (0.0, odds < 0.0)


@pytest.mark.parametrize("doubting", [False, True])
def test_each_filter_sees_the_picture_in_its_own_pose(*, doubting: bool) -> None:
    """The first likelihood is of the filter that was believed, the second of the other."""
    own, others = (lambda at, value=value: np.full(at.shape[:2], value) for value in (-1.0, -2.0))
    rival = Rival(hypotheses_begun(), doubting=doubting, log_odds=-4.0 if doubting else 4.0)
    best, behind = layered.step_rivals(hypotheses_begun(), rival, LAYER, (own, others), SETTINGS, rng(1, 3))
    assert behind.doubting == doubting
    assert np.unique(best.log_likelihoods) == [-1.0]
    assert np.unique(behind.layers.log_likelihoods) == [-2.0]
