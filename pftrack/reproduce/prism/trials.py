"""One course of the turning prism by one method, and what is measured of it.

Bando's 625 frames; all methods of a seed see the same measurements. Errors are mean absolute errors of the
angles, wrapped, over all frames after the first.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.angles import wrap
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.pose import layered
from pftrack.filters import rao_blackwell
from pftrack.filters.affine import AffineLayer
from pftrack.filters.layers import UpperLayer
from pftrack.filters.learning import mixture_em
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.sources.prism import FRAMES, REAR, VERTICES_MM, PrismParameters, Sight, sight
from pftrack.vision.likelihoods import points

__all__ = ["Method", "Reading", "Trial", "TrialResult", "run_trial"]

Method: TypeAlias = Literal["pf-asd", "alpha-1", "alpha-0", "rb-pf"]
Reading: TypeAlias = Literal["chosen", "kernel", "sharp", "underflow"]
"""What is varied: nothing; the kernel mixture in the E step; the noise of a visible vertex for all; the same with
weights that underflow, and are uniform where all do."""

RATIOS: dict[Method, float] = {"pf-asd": 0.5, "alpha-1": 1.0, "alpha-0": 0.0}
RAMP_FRAMES = 60
UNDERFLOW = -745.0
RB_PARTICLES = 25_000


@dataclass(frozen=True, slots=True)
class Trial:
    """What to run.

    Attributes:
        method: How to track.
        seed: Of measurements and filter.
        scene: Parameters of the prism.
        perspective: Whether the upper layer is the pinhole, or the affine camera.
        reading: What is varied.
    """

    method: Method
    seed: int
    scene: PrismParameters = PrismParameters()  # noqa: RUF009 - it is frozen
    perspective: bool = False
    reading: Reading = "chosen"


@dataclass(frozen=True, slots=True)
class TrialResult:
    """What was measured; NaN where the method has no such thing.

    Attributes:
        errors_deg: (3,) mean absolute error of each angle.
        translation_mm: (3,) mean absolute error of the translation.
        visible_px: Mean distance of the features from the truth while visible.
        hidden_px: The same while hidden.
        ratio_front: Mean alpha of the front vertices.
        ratio_visible: Mean alpha of the rear vertices while visible.
        ratio_hidden: Mean alpha of the rear vertices while hidden.
        ramp: (RAMP_FRAMES,) mean alpha of a rear vertex in its k-th hidden frame, k = 1, 2, ...
        effective_sample_size: Median.
    """

    errors_deg: NDArray[np.float64]
    translation_mm: NDArray[np.float64]
    visible_px: float
    hidden_px: float
    ratio_front: float
    ratio_visible: float
    ratio_hidden: float
    ramp: NDArray[np.float64]
    effective_sample_size: float

    @property
    def error_deg(self) -> float:
        """Mean of the three angles' errors."""
        return float(self.errors_deg.mean())


@dataclass(frozen=True, slots=True)
class Row:
    """One frame: the pose, where the features are believed to be, their ratios, and what the upper layer says."""

    theta: NDArray[np.float64]
    features: NDArray[np.float64]
    ratios: NDArray[np.float64]
    translation: NDArray[np.float64]
    effective_sample_size: float = float("nan")


def run_trial(trial: Trial) -> TrialResult:
    """Run a trial and measure."""
    sights = _sights(trial.seed, trial.scene)
    rows = _joint(trial, sights) if trial.method == "rb-pf" else _layer(trial, sights)
    seen = sights[1:]
    errors = wrap(np.array([row.theta - now.theta_rad for row, now in zip(rows, seen, strict=True)]))
    away = np.array([row.translation - now.translation_mm for row, now in zip(rows, seen, strict=True)])
    apart = np.array([row.features - now.true_px for row, now in zip(rows, seen, strict=True)])
    distances = np.hypot(apart[..., 0], apart[..., 1])
    visible = np.array([now.visible for now in seen])
    ratios = np.array([row.ratios for row in rows])
    rear = np.isin(np.arange(len(VERTICES_MM)), REAR)
    return TrialResult(
        errors_deg=np.rad2deg(np.abs(errors).mean(axis=0)),
        translation_mm=np.abs(away).mean(axis=0),
        visible_px=float(distances[visible].mean()),
        hidden_px=float(distances[~visible].mean()),
        ratio_front=float(ratios[:, ~rear].mean()),
        ratio_visible=float(ratios[visible & rear].mean()),
        ratio_hidden=float(ratios[~visible & rear].mean()),
        ramp=_ramp(ratios, visible),
        effective_sample_size=float(np.median([row.effective_sample_size for row in rows])),
    )


def _layer(trial: Trial, sights: tuple[Sight, ...]) -> list[Row]:
    if trial.perspective:
        pinhole = _pinhole(trial.scene)
        return _follow(trial, sights, pinhole, pinhole.begin(), lambda belief: belief.mean[3:6])
    affine = _affine(trial.scene)
    return _follow(trial, sights, affine, affine.begin(), lambda _: np.full(3, np.nan))


def _follow(
    trial: Trial,
    sights: tuple[Sight, ...],
    layer: UpperLayer[layered.S],
    belief: layered.S,
    translation: Callable[[layered.S], NDArray[np.float64]],
) -> list[Row]:
    density: Literal["kernel", "gaussian"] = "kernel" if trial.reading == "kernel" else "gaussian"
    learning = mixture_em.Settings(lower_density=density) if trial.method == "pf-asd" else None
    settings = layered.Settings(learning=learning)
    start = Stream(trial.seed, 0, Purpose.START)
    ratio = RATIOS[trial.method]
    state = layered.begin(layer, belief, sights[0].true_px, settings, start, ratio=ratio)
    rows = []
    for index, now in enumerate(sights[1:], 1):
        ratios = state.mixture.ratios
        rng = Stream(trial.seed, index, Purpose.TRACK)
        state = layered.step(state, layer, _likelihood(trial, now), settings, rng)
        rows.append(Row(state.pose.mean, state.features.means, ratios, translation(state.upper)))
    return rows


def _joint(trial: Trial, sights: tuple[Sight, ...]) -> list[Row]:
    layer = _affine(trial.scene)
    state = rao_blackwell.begin(layer, RB_PARTICLES)
    nothing, nowhere = np.full(len(VERTICES_MM), np.nan), np.full(3, np.nan)
    rows = []
    for index, now in enumerate(sights[1:], 1):
        rng = Stream(trial.seed, index, Purpose.TRACK)
        state = rao_blackwell.step(state, layer, _likelihood(trial, now), rng)
        rows.append(Row(state.pose.mean, state.feature_means, nothing, nowhere, state.effective_sample_size))
    return rows


def _likelihood(trial: Trial, now: Sight) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    known = trial.reading in {"chosen", "kernel"}
    noise_sd = now.noise_sd_px if known else np.full(len(now.noise_sd_px), trial.scene.noise_px)

    def log_likelihood(positions: NDArray[np.float64]) -> NDArray[np.float64]:
        scores = points.log_likelihood(positions, now.points_px, noise_sd)
        if trial.reading == "underflow":
            scores[scores < UNDERFLOW] = -np.inf
        return scores

    return log_likelihood


def _affine(scene: PrismParameters) -> AffineLayer:
    reference = np.zeros((2, 4))
    reference[0, 0] = reference[1, 1] = scene.focal_length_px / scene.distance_mm
    return AffineLayer(VERTICES_MM, reference)


def _pinhole(scene: PrismParameters) -> PerspectiveLayer:
    return PerspectiveLayer(VERTICES_MM, scene.focal_length_px, np.array([0.0, 0.0, 0.0, 0.0, 0.0, scene.distance_mm]))


@lru_cache(maxsize=4)
def _sights(seed: int, scene: PrismParameters) -> tuple[Sight, ...]:
    return tuple(sight(seed, index, scene) for index in range(FRAMES))


def _ramp(ratios: NDArray[np.float64], visible: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the mean ratio (RAMP_FRAMES,) of the rear vertices by how long they have been hidden."""
    sums, counts = np.zeros(RAMP_FRAMES), np.zeros(RAMP_FRAMES)
    for vertex in REAR:
        hidden = 0
        for seen, ratio in zip(visible[:, vertex], ratios[:, vertex], strict=True):
            hidden = 0 if seen else hidden + 1
            if 0 < hidden <= RAMP_FRAMES:
                sums[hidden - 1] += ratio
                counts[hidden - 1] += 1
    ramp: NDArray[np.float64] = np.divide(sums, counts, out=np.full(RAMP_FRAMES, np.nan), where=counts > 0)
    return ramp
