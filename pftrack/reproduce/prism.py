"""The turning prism, whose vertices hide at times: the tables of Bando 2007, ch. 4 section 3.

Bando's 625 frames; all methods of a seed see the same measurements. Errors are mean absolute errors of the angles,
wrapped, over all frames after the first.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.numerics.elementary import wrap
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.shared.pose import layered
from pftrack.filters import affine_pose, rao_blackwell
from pftrack.filters.affine import AffineLayer
from pftrack.filters.layers import UpperLayer
from pftrack.filters.learning import mixture_em
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.reproduce.finding import CHOSEN, FEWER, PROTOCOL, Finding, claim, compare
from pftrack.reproduce.pool import Pool
from pftrack.sources.prism import FRAMES, REAR, VERTICES_MM, PrismParameters, Sight, sight
from pftrack.vision.likelihoods import points

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

    errors_deg: Floats
    translation_mm: Floats
    visible_px: float
    hidden_px: float
    ratio_front: float
    ratio_visible: float
    ratio_hidden: float
    ramp: Floats
    effective_sample_size: float

    @property
    def error_deg(self) -> float:
        """Mean of the three angles' errors."""
        return float(self.errors_deg.mean())


@dataclass(frozen=True, slots=True)
class Row:
    """One frame: the pose, where the features are believed to be, their ratios, and what the upper layer says."""

    theta: Floats
    features: Floats
    ratios: Floats
    translation: Floats
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
    translation: Callable[[layered.S], Floats],
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


def _likelihood(trial: Trial, now: Sight) -> Callable[[Floats], Floats]:
    known = trial.reading in {"chosen", "kernel"}
    noise_sd = now.noise_sd_px if known else np.full(len(now.noise_sd_px), trial.scene.noise_px)

    def log_likelihood(positions: Floats) -> Floats:
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


def _ramp(ratios: Floats, visible: Bools) -> Floats:
    """Return the mean ratio (RAMP_FRAMES,) of the rear vertices by how long they have been hidden."""
    sums, counts = np.zeros(RAMP_FRAMES), np.zeros(RAMP_FRAMES)
    for vertex in REAR:
        hidden = 0
        for seen, ratio in zip(visible[:, vertex], ratios[:, vertex], strict=True):
            hidden = 0 if seen else hidden + 1
            if 0 < hidden <= RAMP_FRAMES:
                sums[hidden - 1] += ratio
                counts[hidden - 1] += 1
    ramp: Floats = np.divide(sums, counts, out=np.full(RAMP_FRAMES, np.nan), where=counts > 0)
    return ramp


# Vertices that hide at times are tracked in two layers. In Bando 2007 the adaptive mixture has the smallest error, the
# upper prediction alone is slightly worse, for its camera is only affine, the features' own prediction alone is thrown
# off by hidden vertices, and the Rao-Blackwellised filter has too few particles. That is so here under the readings of
# docs/methods/adaptive.md, which were chosen to this end; `readings` shows what others give.
#
# With the features' own prediction alone a trial diverges now and then, so its mean says little. Medians are compared,
# with an allowance of three standard errors of both sides: on a pinhole those of twenty trials scatter by 7 %, which is
# more than the 0.05 degrees that the reference allows.

SOURCE = "Bando 2007, ch. 4 section 3.3; reference implementation"
SOURCE_READINGS = "reference implementation"
SOURCE_PERSPECTIVE = "Bando 2007, Appendix E; reference implementation"
SOURCE_POSE = "Bando 2007, Appendix D; reference implementation"

DIVERGING = "some trials diverge, so that the reference's median of twenty is known to 0.22 degrees only"
READING = "what makes the published figures is another reading; with this one the reference fails as well"
NEARLY_AFFINE = "so far away the affine camera is nearly right, and there is nothing to gain; nor in the reference"

METHODS: tuple[Method, ...] = ("pf-asd", "alpha-1", "alpha-0")
DIVERGING_TRIALS = 100
MEDIAN_SPREAD = 0.31
"""Standard error of a median of trials that may diverge, relative to it, times the root of their number; measured."""

AXES = ("theta_x", "theta_y", "theta_z")
ANGLES: dict[Method, tuple[float, float, float]] = {
    "pf-asd": (2.25, 1.97, 1.33),
    "alpha-1": (2.37, 2.41, 1.31),
    "rb-pf": (2.60, 2.61, 1.54),
}
MEANS: dict[Method, tuple[float, float]] = {"pf-asd": (1.85, 0.15), "alpha-1": (2.03, 0.15), "rb-pf": (2.25, 0.25)}
"""Mean error over the axes and its tolerance, degrees."""

RAMP = {1: 0.15, 5: 0.17, 10: 0.26, 20: 0.49, 30: 0.61, 40: 0.72, 50: 0.78, 60: 0.82}
VARIANTS: dict[Reading, dict[Method, float]] = {
    "kernel": {"pf-asd": 1.84, "alpha-1": 2.05, "alpha-0": 2.21},
    "sharp": {"pf-asd": 8.9, "alpha-1": 2.9},
    "underflow": {"pf-asd": 4.9, "alpha-1": 2.2},
}
RATIOS_BY_DISTANCE = {100: 0.35, 120: 0.6}
PERSPECTIVE: dict[bool, dict[Method, tuple[float, tuple[float, float, float]]]] = {
    False: {
        "pf-asd": (0.38, (0.08, 0.08, 0.34)),
        "alpha-1": (0.39, (0.07, 0.08, 0.34)),
        "alpha-0": (1.07, (0.17, 0.20, 0.67)),
    },
    True: {
        "pf-asd": (0.37, (0.10, 0.09, 0.35)),
        "alpha-1": (0.38, (0.10, 0.09, 0.35)),
        "alpha-0": (0.82, (0.18, 0.16, 0.58)),
    },
}
"""Pose error, degrees, and translation errors, mm, by whether the prism moves; medians for `alpha-0`."""


def pose(pool: Pool, full: bool) -> list[Finding]:
    """Errors of pose and features of four methods, and the mixing ratios of the adaptive one."""
    count = 100 if full else 15
    courses = _courses(pool, [Trial(method, seed) for seed in range(count) for method in METHODS])
    courses |= _courses(pool, [Trial("rb-pf", seed) for seed in range(3 if full else 1)])
    findings = []
    for method, (reference, tolerance) in MEANS.items():
        angles = np.mean([one.errors_deg for one in courses[method]], axis=0)
        # A single trial of one axis scatters by more than is allowed.
        for axis, ours, wanted in zip(AXES, angles, ANGLES[method], strict=True) if len(courses[method]) > 1 else ():
            findings.append(
                compare(
                    f"prism: {method}, error of {axis}, degrees",
                    float(ours),
                    wanted,
                    tolerance,
                    SOURCE,
                    ground=PROTOCOL,
                )
            )
        result = f"prism: {method}, error, mean of the axes, degrees"
        findings.append(compare(result, _mean(courses[method], _error), reference, tolerance, SOURCE, ground=PROTOCOL))
    median = float(np.median([one.error_deg for one in courses["alpha-0"]]))
    findings.append(compare("prism: alpha-0, median error, degrees", median, 2.27, 0.25, SOURCE, ground=PROTOCOL))
    return [*findings, *_orders(courses), *_features(courses), *_ratios(courses["pf-asd"])]


def readings(pool: Pool, full: bool) -> list[Finding]:
    """What comes of other readings of the experiment, and of other distances.

    The features' own prediction goes astray with wild measurements that are trusted, in some trials further than in
    others, so that its error has no reference there.
    """
    seeds = range(5 if full else 3)
    findings = []
    for reading, references in VARIANTS.items():
        courses = _courses(pool, [Trial(method, seed, reading=reading) for seed in seeds for method in METHODS])
        for method, reference in references.items():
            result = f"prism-readings: {reading}, {method}, error, degrees"
            ours = _mean(courses[method], _error)
            findings.append(compare(result, ours, reference, round(0.2 * reference, 2), SOURCE_READINGS, ground=CHOSEN))
        if reading == "kernel":
            result = "prism-readings: kernel, alpha of rear vertices while hidden"
            ours = _mean(courses["pf-asd"], lambda one: one.ratio_hidden)
            findings.append(compare(result, ours, 0.24, 0.08, SOURCE_READINGS, ground=CHOSEN))
            rise = _mean(courses["pf-asd"], lambda one: one.ratio_hidden - one.ratio_visible)
            result = "prism-readings: kernel, alpha rises while a vertex is hidden (hidden less visible)"
        else:
            rise = 2.0 * MEANS["pf-asd"][0] - _mean(courses["pf-asd"], _error)
            result = f"prism-readings: {reading}, the pose survives hidden vertices (degrees below twice the error)"
        holds = rise > 0.15
        findings.append(claim(result, rise, holds=holds, source=SOURCE, known=READING))
    for distance in (*RATIOS_BY_DISTANCE, 150):
        scene = PrismParameters(distance_mm=distance)
        courses = _courses(pool, [Trial(method, seed, scene) for seed in seeds for method in ("pf-asd", "alpha-1")])
        ratio = _mean(courses["pf-asd"], lambda one: 0.5 * (one.ratio_front + one.ratio_visible))
        result = f"prism-readings: at {distance} mm, alpha of visible vertices"
        if distance in RATIOS_BY_DISTANCE:
            findings.append(compare(result, ratio, RATIOS_BY_DISTANCE[distance], 0.1, SOURCE_READINGS, ground=CHOSEN))
        else:
            findings.append(
                claim(f"{result} is near its clip of 0.9", ratio, holds=ratio > 0.8, source=SOURCE_READINGS)
            )
        gain = _mean(courses["alpha-1"], _error) - _mean(courses["pf-asd"], _error)
        result = f"prism-readings: at {distance} mm, the mixture beats the upper prediction alone (gain, degrees)"
        findings.append(claim(result, gain, holds=gain > 0.1, source=SOURCE, known=NEARLY_AFFINE))
    return findings


def perspective(pool: Pool, full: bool) -> list[Finding]:
    """Pose and translation with a pinhole as the upper layer, of a prism that stays and of one that moves."""
    count = 20 if full else 6
    findings = []
    for moving, references in PERSPECTIVE.items():
        scene = PrismParameters(translation=float(moving))
        courses = _courses(pool, [Trial(method, seed, scene, True) for seed in range(count) for method in METHODS])
        if full:
            courses |= _courses(pool, [Trial("alpha-0", seed, scene, True) for seed in range(DIVERGING_TRIALS)])
        for method, (error, translation) in references.items():
            name = f"prism-perspective: {'moving' if moving else 'fixed'}, {method}"
            trials = courses[method]
            few = method == "alpha-0" and not full
            slack, ground = (3.0 * MEDIAN_SPREAD * np.sqrt(1.0 / count + 1.0 / 20.0), FEWER) if few else (0.0, PROTOCOL)
            known = DIVERGING if (moving, method) == (False, "alpha-0") else ""
            ours = float(np.median([one.error_deg for one in trials]))
            allowed, result = max(0.05, slack * error), f"{name}, error, degrees"
            findings.append(compare(result, ours, error, allowed, SOURCE_PERSPECTIVE, ground=ground, known=known))
            away = np.median([one.translation_mm for one in trials], axis=0)
            for axis, ours, reference, tolerance in zip("xyz", away, translation, (0.05, 0.05, 0.1), strict=True):
                allowed = max(tolerance, slack * reference)
                result = f"{name}, translation error in {axis}, mm"
                findings.append(compare(result, float(ours), reference, allowed, SOURCE_PERSPECTIVE, ground=ground))
    return findings


def pose_filters(pool: Pool, full: bool) -> list[Finding]:
    """Pose from a noisy affine camera, by the extended Kalman filter and by 500 particles."""
    seeds = range(20 if full else 5)
    findings = []
    for name, function, references in (
        ("extended Kalman filter", partial(_pose_errors, False), (0.42, 0.45, 0.35)),
        ("500 particles", partial(_pose_errors, True), (0.43, 0.50, 0.38)),
    ):
        errors = np.mean(pool.map(function, seeds), axis=0)
        for axis, ours, reference in zip(AXES, errors, references, strict=True):
            findings.append(
                compare(
                    f"pose-filters: {name}, {axis}, degrees", float(ours), reference, 0.08, SOURCE_POSE, ground=PROTOCOL
                )
            )
    return findings


def _courses(pool: Pool, trials: list[Trial]) -> dict[Method, list[TrialResult]]:
    by_method: dict[Method, list[TrialResult]] = {}
    for trial, outcome in zip(trials, pool.map(run_trial, trials), strict=True):
        by_method.setdefault(trial.method, []).append(outcome)
    return by_method


def _mean(courses: list[TrialResult], of: Callable[[TrialResult], float]) -> float:
    return float(np.mean([of(one) for one in courses]))


def _error(one: TrialResult) -> float:
    return one.error_deg


def _orders(courses: dict[Method, list[TrialResult]]) -> list[Finding]:
    error = {method: _mean(outcomes, _error) for method, outcomes in courses.items()}
    gain = error["alpha-1"] - error["pf-asd"]
    findings = [
        claim(
            "prism: the mixture beats the upper prediction alone (gain, degrees)",
            gain,
            holds=gain >= 0.1,
            source=SOURCE,
        )
    ]
    for worse in ("alpha-0", "rb-pf"):
        gain = error[worse] - error["alpha-1"]
        result = f"prism: the upper prediction alone beats {worse} (gain, degrees)"
        findings.append(claim(result, gain, holds=gain > 0, source=SOURCE))
    return findings


def _features(courses: dict[Method, list[TrialResult]]) -> list[Finding]:
    references: dict[Method, tuple[float, float, float, float]] = {
        "pf-asd": (1.54, 0.1, 19.9, 1.5),
        "alpha-1": (4.30, 0.2, 19.9, 1.5),
        "alpha-0": (1.91, 0.3, 62.0, 5.0),
        "rb-pf": (5.5, 0.3, 20.0, 1.5),
    }
    findings = []
    for method, (visible, near, hidden, far) in references.items():
        ours = _mean(courses[method], lambda one: one.visible_px)
        findings.append(compare(f"prism: {method}, visible features, px", ours, visible, near, SOURCE, ground=CHOSEN))
        ours = _mean(courses[method], lambda one: one.hidden_px)
        findings.append(compare(f"prism: {method}, hidden features, px", ours, hidden, far, SOURCE, ground=CHOSEN))
    ours = float(np.median([one.effective_sample_size for one in courses["rb-pf"]]))
    return [
        *findings,
        compare("prism: rb-pf, median effective sample size of 25,000", ours, 1.2, 0.3, SOURCE, ground=CHOSEN),
    ]


def _ratios(courses: list[TrialResult]) -> list[Finding]:
    front, visible = _mean(courses, lambda one: one.ratio_front), _mean(courses, lambda one: one.ratio_visible)
    hidden = _mean(courses, lambda one: one.ratio_hidden)
    rise = hidden - visible
    ramp = np.nanmean([one.ramp for one in courses], axis=0)
    return [
        compare("prism: alpha of front vertices", front, 0.21, 0.08, SOURCE, ground=PROTOCOL),
        compare("prism: alpha of rear vertices while visible", visible, 0.26, 0.08, SOURCE, ground=PROTOCOL),
        compare("prism: alpha of rear vertices while hidden", hidden, 0.52, 0.08, SOURCE, ground=PROTOCOL),
        claim(
            "prism: alpha rises while a vertex is hidden (hidden less visible)", rise, holds=rise > 0.15, source=SOURCE
        ),
        *(
            compare(
                f"prism: alpha, frames since the vertex hid: {age}",
                float(ramp[age - 1]),
                reference,
                0.1,
                SOURCE,
                ground=PROTOCOL,
            )
            for age, reference in RAMP.items()
        ),
    ]


def _pose_errors(by_particles: bool, seed: int) -> Floats:
    """Return the mean absolute errors (3,) of the angles, degrees, from entries of 5 px/mm with noise of 0.05."""
    scene = PrismParameters()
    reference, noise = np.eye(2, 3) * 5.0, 0.05**2 * np.eye(6)
    theta = Gaussian(np.zeros(3), affine_pose.THETA_SD_RAD**2 * np.eye(3))
    particles = theta.sample(Stream(seed, 0, Purpose.START), affine_pose.THETA_COUNT)
    errors = []
    for index in range(1, 150 if by_particles else FRAMES):
        truth = sight(seed, index, scene).theta_rad
        measured = (reference @ rotation(truth)).ravel() + 0.05 * Stream(seed, index, Purpose.SCENE).standard_normal(6)
        if by_particles:
            rng = Stream(seed, index, Purpose.TRACK)
            theta, particles = affine_pose.particle(
                particles, measured, noise, reference, affine_pose.THETA_SD_RAD, rng, affine_pose.THETA_COUNT
            )
        else:
            theta = affine_pose.extended_step(theta, measured, noise, reference, affine_pose.THETA_SD_RAD)
        errors.append(np.abs(wrap(theta.mean - truth)))
    return np.asarray(np.rad2deg(np.mean(errors, axis=0)))
