import numpy as np
import pytest

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.prism.scene import VERTICES_MM, PrismParameters, Sight, sight
from pftrack.experiments.shared.pose import layered
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered, Settings
from pftrack.filters import adaptive
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
    assert np.mean(errors) < 4.0
    assert np.mean(distances) < 4.0


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


def test_the_ratios_are_judged_by_the_prediction() -> None:
    """Ratios of the next frame follow from this frame's survivors and its upper prediction, not the updated belief."""
    state, now = begun(), sight(0, 1, SCENE)
    stepped = layered.step(state, AFFINE, of(now), Settings(), rng(1))
    assert stepped.projection is not None
    assert np.allclose(stepped.projection.positions, AFFINE.project(AFFINE.predict(state.upper)).positions)
    assert not np.allclose(stepped.projection.positions, AFFINE.project(stepped.upper).positions)
    learned = layered.mixture_em.adapt(
        state.mixture,
        adaptive.surviving(stepped.features),
        (stepped.projection.positions, stepped.projection.variances),
        adaptive.propagate(state.features),
        Settings().noise_sd_px,
        layered.mixture_em.Settings(),
    )
    assert np.array_equal(stepped.mixture.ratios, learned.ratios)


def test_a_hidden_feature_is_where_the_solid_has_it() -> None:
    """The ratio of a feature that fits nothing rises to how surely it is hidden; those of the others are as learned."""
    settings = Settings(hidden_weight=0.25)
    state, now, random = begun(settings=settings), sight(0, 1, SCENE), rng(1)
    proposed = layered.propose(state, AFFINE, settings, random)
    scores = of(now)(proposed.drawn.positions)
    covered = 3
    scores[covered] = scores.max() - 20.0 + 0.01 * scores[covered]
    found = layered.conclude(state, proposed, AFFINE, scores, settings, random)
    learned = layered.mixture_em.adapt(
        state.mixture,
        adaptive.surviving(found.features),
        (proposed.projection.positions, proposed.projection.variances),
        adaptive.propagate(state.features),
        settings.noise_sd_px,
        layered.mixture_em.Settings(),
    )
    assert found.hidden[covered] > 0.99
    assert found.hidden[np.arange(8) != covered].max() < 0.5
    most = 1.0 - layered.mixture_em.Settings().clip
    assert learned.ratios[covered] < 0.6 < most
    assert np.array_equal(found.mixture.ratios, np.maximum(learned.ratios, np.minimum(found.hidden, most)))


def test_the_upper_layer_is_never_made_sure_of_itself() -> None:
    """Features whose particles agree to the last are given upwards with the floor's standard deviation."""
    state, now = begun(), sight(0, 1, SCENE)
    sharp: FeatureLikelihood = lambda x: points.log_likelihood(x, now.points_px, np.full(8, 1e-3))  # noqa: E731
    loose, tight = (
        layered.step(state, AFFINE, sharp, Settings(sd_floor_px=floor), rng(1)).upper for floor in (5.0, 0.5)
    )
    predicted = AFFINE.predict(state.upper)
    for floor, upper in ((5.0, loose), (0.5, tight)):
        stepped = layered.step(state, AFFINE, sharp, Settings(sd_floor_px=floor), rng(1))
        exact = AFFINE.update(predicted, stepped.features.means, np.full((8, 2), floor**2), rng(1))
        assert np.allclose(upper.covariance, exact.covariance)
