"""Tracking features in two layers, with a sampling distribution that adapts: PF-ASD.

One frame (Bando 2007, ch. 4, fig. 4.4): predict the upper layer; draw each feature's particles from both predictions;
weigh them by their likelihood; adapt the mixing ratios by what survived; give the features' means back to the upper
layer, which estimates the pose. The ratios of the next frame are judged by the upper *prediction* of this one, before
it has seen the result.

With the ratios fixed at 1 all particles come from above (`alpha-1`), at 0 all from below (`alpha-0`); nothing else
differs. The upper layer and the likelihood are arguments, so that points of a prism and templates of a face are tracked
by the same step.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeAlias, TypeVar

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters import adaptive
from pftrack.filters.adaptive import Draw, Features, Projection, UpperLayer
from pftrack.filters.agreement import ROUNDS, agreeing, middle
from pftrack.filters.learning import mixture_em
from pftrack.filters.learning.mixture_em import Mixture
from pftrack.vision.likelihoods.points import compare, log_fits, mix_hidden

S = TypeVar("S")

DOUBT = 0.25
"""By so much the log variance of a feature grows as its best log likelihood falls below that of a perfect match."""

FURTHER_LOOKS = 2
"""Largest number of passes, for a frame with an uncertain prediction."""

UNSURE = 2.0
"""A prediction is uncertain from this ratio of its variance, including the slack, to that of the slack."""

SURPRISE = 0.36
"""Distance of features from their predictions while the solid moves as expected, as a share of the slack."""

LEAST_LOG_LIKELIHOOD = -40.0
"""Least likelihood that counts; smaller ones are doubted no more than this."""

FeatureLikelihood: TypeAlias = Callable[[Floats], Floats]
"""From positions (F, N, 2) px to log likelihoods (F, N), up to a constant for each feature."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of tracking.

    Attributes:
        sample_count: N, particles per feature.
        noise_sd_px: b_f, process noise of the features' own dynamics, px per frame.
        sd_floor_px: Smallest standard deviation with which a feature's mean is given to the upper layer.
        learning: Settings of adapting the ratios, or None to keep them.
        slack_px: Deviation of a feature from the solid's prediction; 0 for none.
        hidden_weight: Odds that a feature is hidden which fits as well as others; 0 if features are never hidden.
    """

    sample_count: int = 50
    noise_sd_px: float = 5.0
    sd_floor_px: float = 0.5
    learning: mixture_em.Settings | None = mixture_em.Settings()  # noqa: RUF009 - it is frozen
    slack_px: float = 0.0
    hidden_weight: float = 0.0

    @property
    def tolerance_px(self) -> float:
        """Deviation of a feature from its prediction: the slack, or the noise of its own dynamics."""
        return self.slack_px or self.noise_sd_px


@dataclass(frozen=True, slots=True)
class Layered(Generic[S]):
    """The state after a frame, immutable.

    Attributes:
        features: The lower layer, particles of F features.
        upper: The upper layer's belief.
        mixture: The ratios for the next frame's particles, and their learned statistics.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad.
        hidden: (F,) how likely each feature is hidden.
        log_likelihoods: (F, N) of the features' particles, as of visible features; None at the beginning.
        projection: The upper layer's prediction of this frame; None at the beginning.
    """

    features: Features
    upper: S
    mixture: Mixture
    pose: Gaussian
    hidden: Floats
    log_likelihoods: Floats | None = None
    projection: Projection | None = None


@dataclass(frozen=True, slots=True)
class Proposed(Generic[S]):
    """A frame whose particles have been drawn and wait for their likelihood.

    Attributes:
        drawn: The particles.
        upper: The upper layer's predicted belief.
        projection: Its predictions of the features.
        expected: (F, 2) px, where a first look at the frame has found the solid's points; None before it.
    """

    drawn: Draw
    upper: S
    projection: Projection
    expected: Floats | None = None


def begin(
    layer: UpperLayer[S],
    belief: S,
    positions: Floats,
    settings: Settings,
    rng: Generator,
    *,
    ratio: float = 0.5,
    spread_px: float = 1.0,
    speed_px: float = 0.0,
) -> Layered[S]:
    """Begin at known positions.

    Args:
        layer: The upper layer.
        belief: Its initial belief.
        positions: (F, 2) px of the features.
        settings: The settings of tracking.
        rng: The frame's generator.
        ratio: alpha of all features; with `settings.learning` None it stays.
        spread_px: Standard deviation of the particles around the positions.
        speed_px: Standard deviation of their speed, px per frame.
    """
    features = adaptive.begin(positions, spread_px, settings.sample_count, rng, speed_px)
    count = len(positions)
    return Layered(features, belief, mixture_em.begin(count, ratio), layer.pose(belief), np.zeros(count))


def step(
    state: Layered[S],
    layer: UpperLayer[S],
    log_likelihood: FeatureLikelihood,
    settings: Settings,
    rng: Generator,
) -> Layered[S]:
    """Advance by one observation, given the likelihood of positions in it."""
    proposed = propose(state, layer, settings, rng)
    after = conclude(state, proposed, layer, log_likelihood(proposed.drawn.positions), settings, rng)
    if settings.slack_px > 0.0:
        for _ in range(FURTHER_LOOKS):
            if proposed.projection.variances.mean() < UNSURE * settings.slack_px**2:
                break
            again = _closer(proposed, after, layer, settings, rng)
            after = conclude(state, again, layer, log_likelihood(again.drawn.positions), settings, rng)
    return after


def propose(state: Layered[S], layer: UpperLayer[S], settings: Settings, rng: Generator) -> Proposed[S]:
    """Predict the upper layer and draw the features' particles: the half of a step before the observation."""
    upper = layer.predict(state.upper)
    projection = layer.project(upper)
    if settings.slack_px > 0.0:
        projection = _slacken(projection, settings)
    drawn = adaptive.draw(
        state.features, projection, state.mixture.ratios, settings.noise_sd_px, settings.sample_count, rng
    )
    return Proposed(drawn, upper, projection)


def _closer(
    proposed: Proposed[S], after: Layered[S], layer: UpperLayer[S], settings: Settings, rng: Generator
) -> Proposed[S]:
    """Draw all particles once more, where a first look at the same frame has found the solid to be.

    Where the prediction is uncertain, as in the first frame of a moving head, fifty particles in such a wide region
    find some features and mistake others. The prediction to update stays the same.
    """
    found = _slacken(layer.project(after.upper), settings)
    ratios = np.ones(len(found.means))
    drawn = adaptive.draw(after.features, found, ratios, settings.noise_sd_px, settings.sample_count, rng)
    return replace(proposed, drawn=drawn, expected=found.positions)


def _slacken(projection: Projection, settings: Settings) -> Projection:
    """Return a prediction wider by the slack; a feature that is off its place now was so in the last frame."""
    return replace(projection, covariances=projection.covariances + settings.slack_px**2)


def conclude(
    state: Layered[S],
    proposed: Proposed[S],
    layer: UpperLayer[S],
    log_likelihoods: Floats,
    settings: Settings,
    rng: Generator,
) -> Layered[S]:
    """Weigh, adapt the ratios, and update the upper layer and the pose: the half after the observation.

    Args:
        state: State of the last frame.
        proposed: Result of `propose`.
        layer: The upper layer.
        log_likelihoods: (F, N) of the particles drawn, up to a constant for each feature.
        settings: The settings of tracking.
        rng: The frame's generator, after `propose` has drawn from it.
    """
    hidden, visible = np.zeros(len(log_likelihoods)), log_likelihoods
    if settings.hidden_weight > 0.0:
        surprise_px = SURPRISE * settings.tolerance_px
        log_likelihoods, hidden = mix_hidden(
            visible, proposed.drawn.positions, _expected(proposed), settings.hidden_weight, surprise_px
        )
    features = adaptive.weigh(proposed.drawn, log_likelihoods, rng)
    mixture = state.mixture
    if settings.learning is not None:
        projection = proposed.projection
        mixture = mixture_em.adapt(
            mixture,
            adaptive.surviving(features),
            (projection.positions, projection.variances),
            adaptive.propagate(state.features),
            settings.noise_sd_px,
            settings.learning,
        )
        # Equally likely particles do not distinguish the predictions: a hidden feature is where the solid predicts it.
        followed = np.minimum(hidden, 1.0 - settings.learning.clip)
        mixture = replace(mixture, ratios=np.maximum(mixture.ratios, followed))
    if settings.slack_px > 0.0:
        upper = _update_by_agreement(proposed, layer, features, log_likelihoods, settings, rng)
    else:
        variances = np.maximum(features.variances, settings.sd_floor_px**2)
        upper = layer.update(proposed.upper, features.means, variances, rng)
    return Layered(features, upper, mixture, layer.pose(upper), hidden, visible, proposed.projection)


def _expected(proposed: Proposed[S]) -> Floats:
    """Return where the solid has its points, (F, 2) px, before this look at the frame."""
    return proposed.projection.positions if proposed.expected is None else proposed.expected


def _update_by_agreement(
    proposed: Proposed[S],
    layer: UpperLayer[S],
    features: Features,
    log_likelihoods: Floats,
    settings: Settings,
    rng: Generator,
) -> S:
    """Update the upper layer by the features that agree with it; features with equally likely particles are ignored.

    At first only the middle of the features is taken from the picture, for the prediction is off by the same for all.
    """
    best = log_likelihoods.max(axis=1)
    telling = best > log_likelihoods.min(axis=1)
    expected = _expected(proposed)
    if proposed.expected is None and telling.any():
        expected = expected + middle((features.means - expected)[telling])
    doubts = np.where(telling, exponential(-DOUBT * np.maximum(best, LEAST_LOG_LIKELIHOOD)), np.inf)
    positions, weights = np.ascontiguousarray(features.positions), exponential(features.log_weights)
    upper = proposed.upper
    for attempt in range(ROUNDS):
        if attempt > 0:
            expected = layer.project(upper).positions
        means, variances = agreeing(positions, weights, expected, doubts, settings.slack_px, settings.sd_floor_px)
        upper = layer.update(proposed.upper, means, variances, rng)
    return upper


# A feature that looks like nothing is covered, or the solid has moved and its pose is behind. One frame does not decide
# between both: trusting the features follows every cover, and doubting them ignores a head that turns unexpectedly. So
# both hypotheses are kept, each as a filter with its own pose, and once they differ the pictures decide. It is a filter
# of multiple models (Blom & Bar-Shalom, IEEE Transactions on Automatic Control 33, 1988) without mixing, since the mean
# of two poses is wrong where one of them is.
#
# The log odds of the two compare the fit of all features at the places given by each pose, discounted from frame to
# frame. A feature that fits at neither place counts for neither, so a cover does not count. The doubting filter is
# replaced only at clear odds; a filter that is far behind restarts from the other.

DISCOUNT = 0.8
"""Share of the last frame's log odds that is kept."""

BETTER = 2.0
"""Log odds required to trust all features once some were doubted."""

CLEAR = 5.0
"""Log odds at which nothing is taken to be hidden."""

HOPELESS = 20.0
"""Log odds by which a filter is so far behind that it begins again from the other."""


@dataclass(frozen=True, slots=True)
class Rival(Generic[S]):
    """The filter that is not in use now.

    Attributes:
        layers: Its state.
        doubting: Whether it doubts features; the filter in use then takes all for visible.
        log_odds: For the filter that doubts, against the one that does not; discounted.
    """

    layers: Layered[S]
    doubting: bool
    log_odds: float

    @property
    def all_visible(self) -> bool:
        """Whether the odds clearly show that no feature is hidden."""
        return self.log_odds < -CLEAR


def step_rivals(
    believed: Layered[S],
    rival: Rival[S] | None,
    layer: UpperLayer[S],
    log_likelihoods: tuple[FeatureLikelihood, FeatureLikelihood],
    settings: Settings,
    rng: Generator,
) -> tuple[Layered[S], Rival[S]]:
    """Advance both filters by one observation, and return the one in use and the other.

    Args:
        believed: The filter in use.
        rival: The other; None at first, when the doubting one is in use and the other begins from it.
        layer: The upper layer.
        log_likelihoods: Functions of positions in the observation, for the filter in use and for the other: a template
            looks different in another pose.
        settings: The settings of tracking, with the odds of hidden features.
        rng: The frame's generator.
    """
    rival = rival or Rival(believed, doubting=False, log_odds=0.0)
    own, others = log_likelihoods
    trusting = replace(settings, hidden_weight=0.0)
    one = step(believed, layer, own, trusting if rival.doubting else settings, rng)
    other = step(rival.layers, layer, others, settings if rival.doubting else trusting, rng)
    doubts, trusts = (other, one) if rival.doubting else (one, other)
    log_odds = DISCOUNT * rival.log_odds + compare(_fits(doubts, layer, settings), _fits(trusts, layer, settings))
    doubted = log_odds > 0.0 if rival.doubting else log_odds >= -BETTER
    best, behind = (doubts, trusts) if doubted else (trusts, doubts)
    if doubted == rival.doubting:
        # The last frame used the particles of the other filter, so these have no parents among them.
        best = replace(best, features=adaptive.orphan(best.features))
    if abs(log_odds) > HOPELESS:
        behind, log_odds = best, 0.0
    return best, Rival(behind, doubting=not doubted, log_odds=log_odds)


def _fits(after: Layered[S], layer: UpperLayer[S], settings: Settings) -> Floats:
    """Return the fit of each feature where a filter's pose places it, (F,) log likelihoods."""
    if after.log_likelihoods is None:
        raise ValueError("a filter is compared after a step, not at its beginning")
    expected = layer.project(after.upper).positions
    return log_fits(after.log_likelihoods, after.features.positions, expected, settings.tolerance_px)
