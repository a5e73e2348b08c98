"""Features in layers, and two filters of a solid of which one doubts features."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.prism.scene import VERTICES_MM, PrismParameters, Sight, sight
from pftrack.experiments.shared.pose import layered
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered, Rival, Settings
from pftrack.filters import adaptive
from pftrack.filters.adaptive import Projection
from pftrack.filters.affine import AffineLayer
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.vision.likelihoods import points

SCENE = PrismParameters()
AFFINE = AffineLayer(VERTICES_MM, np.array([[5.0, 0, 0, 0], [0, 5.0, 0, 0]]))
PINHOLE = PerspectiveLayer(VERTICES_MM, 400.0, np.array([0, 0, 0, 0, 0, 80.0]))
LAYERS = {"affine": AFFINE, "affine, particles": AffineLayer(VERTICES_MM, AFFINE.reference, estimator="particle")}
LAYERS |= {"pinhole": PINHOLE}
NOTHING_LEARNED = Settings(learning=None)


def rng(frame: int, seed: int = 0) -> Stream:
    return Stream(seed, frame, Purpose.TRACK)


def of(now: Sight) -> FeatureLikelihood:
    return lambda positions: points.log_likelihood(positions, now.points_px, now.noise_sd_px)


def begun(layer: AffineLayer = AFFINE, settings: Settings = Settings(), ratio: float = 0.5) -> Layered:  # noqa: B008 - frozen
    start = Stream(0, 0, Purpose.START)
    return layered.begin(layer, layer.begin(), sight(0, 0, SCENE).true_px, settings, start, ratio=ratio)


@pytest.mark.parametrize("layer", LAYERS.values(), ids=LAYERS)
def test_the_prism_is_followed(layer: AffineLayer) -> None:
    """Over eighty frames every upper layer has the angles to 4 degrees and the visible vertices to 4 px on average."""
    state, errors, distances = begun(layer), [], []
    for t in range(1, 80):
        now = sight(0, t, SCENE)
        state = layered.step(state, layer, of(now), Settings(), rng(t))
        errors.append(np.abs(np.rad2deg(state.pose.mean - now.theta_rad)))
        distances.append(np.hypot(*(state.features.means - now.true_px).T)[now.visible].mean())
        assert (np.linalg.eigvalsh(state.pose.covariance) > 0).all()
    assert max(np.mean(errors), np.mean(distances)) < 4.0


def test_a_step_is_its_two_halves() -> None:
    """Proposing, scoring the particles elsewhere and concluding gives what a step gives."""
    state, now, random = begun(), sight(0, 1, SCENE), rng(1)
    proposed = layered.propose(state, AFFINE, Settings(), random)
    assert proposed.drawn.positions.shape == (8, 50, 2)
    concluded = layered.conclude(state, proposed, AFFINE, of(now)(proposed.drawn.positions), Settings(), random)
    stepped = layered.step(state, AFFINE, of(now), Settings(), rng(1))
    assert np.array_equal(concluded.features.coordinates, stepped.features.coordinates)
    assert np.array_equal(concluded.mixture.ratios, stepped.mixture.ratios)
    assert np.array_equal(concluded.pose.mean, stepped.pose.mean)


@pytest.mark.parametrize("ratio", [0.0, 1.0])
def test_fixed_ratios_stay(ratio: float) -> None:
    """Without learning all particles come from one prediction for good, beyond any clip."""
    state = begun(settings=NOTHING_LEARNED, ratio=ratio)
    for t in range(1, 5):
        state = layered.step(state, AFFINE, of(sight(0, t, SCENE)), NOTHING_LEARNED, rng(t))
        assert state.mixture.ratios.tolist() == [ratio] * 8
        assert state.features.upper_counts.tolist() == [round(50 * ratio)] * 8


def learned(state: Layered, after: Layered, projection: Projection) -> NDArray[np.float64]:
    """Return the ratios that follow from the survivors of a frame and its upper prediction."""
    projected = projection.positions, projection.variances
    own, noise_px = adaptive.propagate(state.features), Settings().noise_sd_px
    survivors, settings = adaptive.surviving(after.features), layered.mixture_em.Settings()
    return layered.mixture_em.adapt(state.mixture, survivors, projected, own, noise_px, settings).ratios


def test_the_ratios_are_judged_by_the_prediction() -> None:
    """Ratios of the next frame follow from this frame's survivors and its upper prediction, not the updated belief."""
    state = begun()
    stepped = layered.step(state, AFFINE, of(sight(0, 1, SCENE)), Settings(), rng(1))
    assert np.allclose(stepped.projection.positions, AFFINE.project(AFFINE.predict(state.upper)).positions)
    assert not np.allclose(stepped.projection.positions, AFFINE.project(stepped.upper).positions)
    assert np.array_equal(stepped.mixture.ratios, learned(state, stepped, stepped.projection))


def test_a_hidden_feature_is_where_the_solid_has_it() -> None:
    """The ratio of a feature that fits nothing rises to how surely it is hidden; those of the others are as learned."""
    settings, covered = Settings(hidden_weight=0.25), 3
    state, random = begun(settings=settings), rng(1)
    proposed = layered.propose(state, AFFINE, settings, random)
    scores = of(sight(0, 1, SCENE))(proposed.drawn.positions)
    scores[covered] = scores.max() - 20.0 + 0.01 * scores[covered]
    found = layered.conclude(state, proposed, AFFINE, scores, settings, random)
    ratios = learned(state, found, proposed.projection)
    assert found.hidden[covered] > 0.99
    assert np.delete(found.hidden, covered).max() < 0.5
    most = 1.0 - layered.mixture_em.Settings().clip
    assert ratios[covered] < 0.6 < most
    assert np.array_equal(found.mixture.ratios, np.maximum(ratios, np.minimum(found.hidden, most)))


def test_the_upper_layer_is_never_made_sure_of_itself() -> None:
    """Features whose particles agree to the last are given upwards with the floor's standard deviation."""
    state, now = begun(), sight(0, 1, SCENE)
    for floor in (5.0, 0.5):
        sharp = of(replace(now, noise_sd_px=np.full(8, 1e-3)))
        stepped = layered.step(state, AFFINE, sharp, Settings(sd_floor_px=floor), rng(1))
        prior, variances = AFFINE.predict(state.upper), np.full((8, 2), floor**2)
        exact = AFFINE.update(prior, stepped.features.means, variances, rng(1))
        assert np.allclose(stepped.upper.covariance, exact.covariance)


# Two filters of a solid, of which one doubts features: the pictures decide which is believed.

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
    [(-1.0, False, True), (-3.0, False, False), (-1.0, True, False), (1.0, True, True)],
    ids=["doubts stay", "doubts are given up", "trust stays", "trust is given up"],
)
def test_who_is_believed_changes_only_where_it_is_clear(odds: float, *, doubting: bool, after: bool) -> None:
    """Two filters that are alike add nothing to the odds, so what was known decides, discounted."""
    rival = Rival(hypotheses_begun(), doubting=doubting, log_odds=odds / 0.8)
    one, other = rivals(hypotheses_begun(), rival, STILL, settings=replace(SETTINGS, hidden_weight=1e-12))
    assert other.log_odds == pytest.approx(odds, abs=0.9)
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


def test_what_was_known_counts_the_less_from_frame_to_frame() -> None:
    """The same filter twice adds nothing; a fifth of the log odds is forgotten."""
    same = replace(SETTINGS, hidden_weight=1e-300, sample_count=400)
    _, after = rivals(
        hypotheses_begun(), Rival(hypotheses_begun(), doubting=True, log_odds=-15.0), STILL, settings=same
    )
    assert after.log_odds == pytest.approx(-12.0, abs=0.5)


@pytest.mark.parametrize("doubting", [False, True])
def test_each_filter_sees_the_picture_in_its_own_pose(*, doubting: bool) -> None:
    """The first likelihood is of the filter that was believed, the second of the other."""
    own, others = (lambda at, value=value: np.full(at.shape[:2], value) for value in (-1.0, -2.0))
    rival = Rival(hypotheses_begun(), doubting=doubting, log_odds=-4.0 if doubting else 4.0)
    best, behind = layered.step_rivals(hypotheses_begun(), rival, LAYER, (own, others), SETTINGS, rng(1, 3))
    assert behind.doubting == doubting
    assert np.unique(best.log_likelihoods) == [-1.0]
    assert np.unique(behind.layers.log_likelihoods) == [-2.0]


def test_one_that_is_far_behind_begins_again() -> None:
    """It is then where the other is, and nothing is held against it."""
    for odds in (40.0, -40.0):
        rival = Rival(hypotheses_begun(), doubting=odds < 0.0, log_odds=odds)
        best, behind = rivals(hypotheses_begun(), rival, STILL)
        assert behind.layers is best
        assert (behind.log_odds, behind.doubting) == (0.0, odds < 0.0)
