"""A calibrated band of the pose, in addition to Bando's, which is too narrow.

Bando's filters assume that each point's mean has an error as large as the spread of its particles, independent of all
other points and frames. Measured on simulated prisms and heads (`docs/explanation/calibration.md`), too much confidence
comes from

- the affine camera: an error of several px that depends on the pose, nearly all of it on the near prism;
- the shape of the face, and slipped templates: errors that last as long as the pose, most of it on heads;
- fifty particles with the weight on two or three, whose spread is too small: all of it on the prism before a pinhole.

The first two outlast the memory of the filters, which is two or three frames. A state for each of them (a
Schmidt-Kalman filter, or a Gauss-Markov error of each point) then shows this: averaging over frames gains nothing, and
the pose is as uncertain as a fit of the solid to the points of one frame, with their whole error. So the band is that
of the fit:

- the variance of a point is v / (1 - kappa), unbiased, with kappa the sum of its particles' squared weights;
- all points share an excess variance, estimated from their misfit to the solid (`pftrack.filters.agreement`); its mean
  over the last frames is used, since it changes as slowly as the pose;
- a point that may be hidden has the precision of its particles that see it, times the probability that it is visible
  (`pftrack.vision.likelihoods.points`);
- a solid and a camera that are known exactly give the error of the affine camera, which is subtracted from the
  estimate;
- for an unknown solid, the first picture gives its points in that picture's plane, and they are compared as seen there.
It does not give the solid's depth. A wrong depth looks like a smaller or larger turn and does not show in a misfit, so
its uncertainty is given in advance (`Solid.depth_doubt`), as is the share of the misfit that moves the pose.

An error that looks like another pose, and is not among these, cannot be detected: a face is sometimes off as a whole.
So the errors of a head have heavier tails than a Gaussian, and its band is that of Student's t with four degrees of
freedom (`Solid.widths`). Its 95 % lie within 1.96 standard deviations, like a Gaussian's, but its 50 % within 0.52.
"""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import field_validator

from pftrack.core.arrays import Floats
from pftrack.core.geometry import derivatives, rotation, turn
from pftrack.core.model.parameters import Parameters, Value, parameter
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import contiguous_copy, multiply, product
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared.pose.state import GAUSSIAN, Belief, Solid
from pftrack.experiments.shared.reports import loss_share
from pftrack.filters import perspective
from pftrack.filters.agreement import excess_variance, fit_covariance, fit_gain
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance

# Parameters of the trackers of a solid's points: two layers, and the trust in each.

FEATURES, MIXTURE, UPPER, SCORING = "Features", "Which prediction to trust", "Pose", "Scoring"
LAYERED = ("pf-asd", "alpha-1", "alpha-0")

AS_PUBLISHED: dict[str, Value] = {"upper_layer": "affine", "pose_band": "document"}
"""Settings of Bando 2007 that differ from the defaults."""


def particles_per_feature(features: int) -> Any:  # noqa: ANN401 - as of `parameter`
    """Declare the number of particles of each feature, given how many features a solid has at most."""
    return parameter(
        50,
        "Particles per feature",
        "Number of particles of each feature.",
        within=(2, 5000, 1),
        useful=(2, 500),
        trackers=LAYERED,
        role="particles",
        sets=features,
    )


def joint_particles(count: int, remark: str = "") -> Any:  # noqa: ANN401 - as of `parameter`
    """Declare the number of particles that carry all features at once, with a remark on it."""
    return parameter(
        count,
        "Joint particles",
        f"Number of particles that carry all features at once{remark}.",
        within=(10, 100_000, 10),
        useful=(100, 50_000),
        trackers=("rb-pf",),
        role="particles",
    )


def pose_guidance(experiment: str) -> Guidance:
    """Return how the runs of an experiment on a pose are learned from: by the angles, in which nothing is a place."""
    return Guidance(experiment, Chart(angles=("theta_x", "theta_y", "theta_z")), "", scale=float(np.rad2deg(1.0)))


class _Features(Parameters, group=FEATURES, trackers=LAYERED):
    """Particles of the features, and how surely a feature is placed."""

    sample_count: int = particles_per_feature(1)
    feature_noise_px: float = parameter(
        5, "Feature noise", unit="px", within=(0.1, 50, 0.1), useful=(0.5, 15), role="noise"
    )
    """Process noise of the features' own dynamics, each frame."""
    sd_floor_px: float = parameter(0.5, "Smallest deviation", unit="px", within=(0.05, 20, 0.05), useful=(0.05, 3))
    """Least standard deviation of a feature's position."""
    initial_sd_px: float = parameter(1, "Initial spread", unit="px", within=(0, 50, 0.1), useful=(0, 10), live=False)
    """Standard deviation of the particles around the features at the start."""
    joint_sample_count: int = joint_particles(25_000)


class _Mixture(Parameters, group=MIXTURE, trackers=("pf-asd",)):
    """How the share of each prediction follows its success."""

    forgetting: float = parameter(0.5, "Forgetting", within=(0, 1, 0.01), role="memory")
    """Weight of the past in adapting alpha; at 0.5 the memory is about two frames, at 1 it is all of the past."""
    alpha_clip: float = parameter(0.1, "Clip of alpha", within=(0.01, 0.5, 0.01))
    """Least share of a feature's particles that either prediction keeps."""
    lower_density: Literal["gaussian", "kernel"] = parameter("gaussian", "Density of the own prediction")
    """Form of the own prediction in adapting alpha: one Gaussian, or a kernel around each particle."""


class _Upper(Parameters, group=UPPER):
    """Which camera predicts the pose, and how fast the pose may change."""

    upper_layer: Literal["perspective", "affine"] = parameter(
        "perspective", "Camera of the upper layer", trackers=LAYERED
    )
    """Whether the solid is predicted by pose and place before a pinhole, or by an affine camera (Bando 2007), which is
    wrong near the camera."""
    pose_estimator: Literal["extended", "particle"] = parameter(
        "extended", "Pose from the affine camera", trackers=LAYERED
    )
    """Whether the angles are found by an extended Kalman filter or by particles."""
    pose_sample_count: int = parameter(
        500, "Particles of the pose", within=(10, 20_000, 10), useful=(100, 5000), trackers=LAYERED, role="particles"
    )
    """Number of particles, if the angles are found by particles."""
    pose_noise_deg: float = parameter(
        3, "Pose noise", unit="°", within=(0.05, 30, 0.05), useful=(0.5, 10), role="noise"
    )
    """How far each angle may turn in a frame, beside the affine camera."""
    learned: str = parameter("", "Learned turns", accept=".json")
    """How far the angles turn in a frame, and which of them together, beside the affine camera: a file that pftrack
    learn or Export and import has written. It takes the place of the pose noise."""
    camera_noise: float = parameter(1, "Camera noise", within=(0.05, 20, 0.05), useful=(0.05, 5), role="noise")
    """How fast the upper layer may change, as a multiple of Bando's noise."""
    pose_band: Literal["calibrated", "document"] = parameter("calibrated", "Band of the pose")
    """Whether the angles' uncertainty follows the points' misfit, or Bando's filters, which are far too confident; the
    calibrated band also subtracts the affine camera's error from the estimate where solid and camera are known."""


class _Scoring(Parameters, group=SCORING):
    """When a pose counts as lost."""

    lost_deg: float = parameter(15, "Limit of success", unit="°", within=(0.5, 180, 0.5), useful=(1, 45))
    """The pose counts as lost when it is further off than this, averaged over the axes."""
    lost_share: float = loss_share(0.1)


class PoseTrackerParameters(_Scoring, _Upper, _Mixture, _Features):
    """Everything that trackers of a solid's points have in common.

    Attributes:
        guidance: Declaration for learning from the experiment's runs.
    """

    guidance: ClassVar[Guidance] = pose_guidance("")

    @field_validator("learned")
    @classmethod
    def _fits(cls, text: str) -> str:
        if text:
            cls.guidance.parse(text)
        return text

    @property
    def walk(self) -> Floats | None:
        """(3, 3) covariance of the turns in a frame, rad^2, if it was learned."""
        return self.guidance.parse(self.learned).diffusion("fixed").covariance if self.learned else None

    @property
    def pose_change(self) -> float:
        """How fast the pose before a pinhole may change, as a multiple of Bando's noise."""
        return self.camera_noise

    @property
    def slack(self) -> float:
        """Deviation of a point from the solid's prediction, px; 0 in Bando 2007."""
        return 0.0

    @property
    def hidden_odds(self) -> float:
        """Odds that a point is hidden which looks as it should; in Bando 2007 a point that is hidden looks so."""
        return 0.0

    @property
    def speed_at_start(self) -> float:
        """Speed of points at the start of tracking, px a frame; in Bando 2007 they are at rest."""
        return 0.0


PERSISTENCE = 0.8
"""Weight of the past in the variance in excess: the memory is five frames."""

LEAST_SHOWN = 1e-3
"""A point that is hidden more surely counts as if it were as sure as this."""

NEAREST = 0.1
"""Assumed least distance of a point from the camera, as a share of the solid's distance."""


def pose_and_band(
    before: float | None, solid: Solid, belief: Belief, parameters: PoseTrackerParameters
) -> tuple[Gaussian, float | None]:
    """Return the belief in the angles as the parameters ask for it, and the excess that its band remembers, px^2.

    Args:
        before: The excess of the last frame, px^2, if the band was asked for then.
        solid: The tracked solid.
        belief: In this frame.
        parameters: In force.
    """
    if parameters.pose_band == "document":
        return belief.pose, None
    theta, reference = contiguous_copy(belief.pose.mean), contiguous_copy(solid.reference[:, :3])
    points_mm = contiguous_copy(solid.points_mm if solid.pinned_mm is None else solid.pinned_mm)
    principal_px, place = contiguous_copy(solid.principal_px), belief.place_mm
    bend = np.zeros((len(points_mm), 2))
    if place is None:
        offset_px = contiguous_copy(belief.camera(solid)[:, 3])
        expected, jacobian = _affine(points_mm, theta, offset_px, reference)
        if solid.pinned_mm is None:
            nearer = nearness(points_mm, theta, reference, solid.focal_px / solid.scale)
            bend = (nearer[:, None] - 1.0) * (expected - principal_px)
    else:
        state = np.concatenate([theta, place])
        expected, slopes = perspective.features(state, points_mm, float(solid.focal_px))
        expected, jacobian = expected + principal_px, slopes.reshape(-1, 6)
    means, own, scarce = seen_moments(belief)
    shown = np.repeat(np.maximum(1.0 - belief.hidden, LEAST_SHOWN), 2)
    told = contiguous_copy(np.maximum(own, parameters.sd_floor_px**2)).ravel() / shown
    variances = told * np.repeat(scarce, 2)
    excess = excess_variance(contiguous_copy(means - expected - bend).ravel(), jacobian, variances, shown)
    gain, _ = fit_gain(jacobian, 1.0 / told)
    if not np.isfinite(gain).all() or (before is None and not np.isfinite(excess)):
        return belief.pose, before
    if before is not None:
        news = excess - before if np.isfinite(excess) else 0.0  # too few visible points to estimate it
        excess = before + (1.0 - PERSISTENCE) * news
    deeper = product(gain, depth_slopes(points_mm, theta, reference).ravel())[:3]
    doubt = solid.depth_doubt**2 * deeper[:, None] * deeper
    band = solid.misfit_share * fit_covariance(gain, variances + excess)[:3, :3] + doubt
    mistake = product(gain, bend.ravel())[:3]
    # This is the error of half of the frames; heavier tails do not change it but add to the variance.
    band *= (GAUSSIAN.half / solid.widths.half) ** 2
    return Gaussian(theta - mistake, band), float(excess)


@compiled
def pin(
    points_mm: Floats,
    seen_px: Floats,
    expected_px: Floats,
    slopes: Floats,
) -> Floats:
    """Return points (F, 3) moved, by as little as possible, to where they were seen in the first picture.

    Args:
        points_mm: Points of the model.
        seen_px: (F, 2) in the picture.
        expected_px: (F, 2) where the camera sees the model's.
        slopes: (F, 2, 3) derivatives of these by the points, px/mm.
    """
    moved = points_mm.copy()
    for n in range(points_mm.shape[0]):
        first = second = mixed = 0.0
        for i in range(3):
            first += slopes[n, 0, i] * slopes[n, 0, i]
            second += slopes[n, 1, i] * slopes[n, 1, i]
            mixed += slopes[n, 0, i] * slopes[n, 1, i]
        x, y = seen_px[n, 0] - expected_px[n, 0], seen_px[n, 1] - expected_px[n, 1]
        area = first * second - mixed * mixed
        if area > 0.0:
            along, across = (second * x - mixed * y) / area, (first * y - mixed * x) / area
            for i in range(3):
                moved[n, i] += slopes[n, 0, i] * along + slopes[n, 1, i] * across
    return moved


@compiled
def nearness(points_mm: Floats, theta: Floats, slopes: Floats, distance_mm: float) -> Floats:
    """Return the factors (F,) by which a pinhole sees points further from its principal point than an affine camera.

    Args:
        points_mm: (F, 3) in the solid's frame.
        theta: (3,) its angles, rad.
        slopes: (2, 3) of the affine camera at theta = 0, px/mm, whose line of sight is across its rows.
        distance_mm: Distance of the solid's origin.
    """
    along = multiply(_line_of_sight(slopes).reshape(1, 3), rotation(theta))
    factors = np.empty(points_mm.shape[0])
    for n in range(points_mm.shape[0]):
        depth = 0.0
        for i in range(3):
            depth += along[0, i] * points_mm[n, i]
        factors[n] = 1.0 / max(1.0 + depth / distance_mm, NEAREST)
    return factors


@compiled
def depth_slopes(points_mm: Floats, theta: Floats, slopes: Floats) -> Floats:
    """Return how points (F, 3) move in the picture, (F, 2) px, if the solid is twice as deep; nothing at theta = 0.

    The depth is from the points' mean, along the line of sight of the first camera's A_0, `slopes`, (2, 3).
    """
    line = _line_of_sight(slopes)
    moved = multiply(slopes, multiply(rotation(theta), line.reshape(3, 1)))
    count = points_mm.shape[0]
    depths, mean = np.zeros(count), 0.0
    for n in range(count):
        for i in range(3):
            depths[n] += line[i] * points_mm[n, i]
        mean += depths[n] / count
    found = np.empty((count, 2))
    for n in range(count):
        for axis in range(2):
            found[n, axis] = (depths[n] - mean) * moved[axis, 0]
    return found


@compiled
def _line_of_sight(slopes: Floats) -> Floats:
    """Return the direction (3,), away from the camera, along which an affine camera (2, 3) sees nothing move."""
    line = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        line[i] = slopes[0, j] * slopes[1, k] - slopes[0, k] * slopes[1, j]
    length = np.sqrt(line[0] ** 2 + line[1] ** 2 + line[2] ** 2)
    return line / length if length > 0.0 else line


@compiled
def _affine(
    points_mm: Floats,
    theta: Floats,
    offset_px: Floats,
    slopes: Floats,
) -> tuple[Floats, Floats]:
    """Return where A_0 R(theta) X + c is, (F, 2), and the derivatives (2 F, 5) by theta and c."""
    count = points_mm.shape[0]
    expected = turn(points_mm, multiply(slopes, rotation(theta)))
    turns = derivatives(theta)
    jacobian = np.zeros((2 * count, 5))
    for k in range(3):
        moved = turn(points_mm, multiply(slopes, turns[k]))
        for n in range(count):
            for axis in range(2):
                jacobian[2 * n + axis, k] = moved[n, axis]
    for n in range(count):
        for axis in range(2):
            expected[n, axis] += offset_px[axis]
            jacobian[2 * n + axis, 3 + axis] = 1.0
    return expected, jacobian


def seen_moments(belief: Belief) -> tuple[Floats, Floats, Floats]:
    """Return the belief in visible points: means (F, 2) px, variances (F, 2) px^2, scarcity (F,).

    The scarcity is 1 / (1 - kappa), at most N: see the module.
    """
    positions = contiguous_copy(belief.positions)
    log_weights = np.broadcast_to(np.atleast_2d(belief.log_weights), positions.shape[:2])
    return _seen_moments(positions, contiguous_copy(log_weights), contiguous_copy(belief.hidden))


@compiled
def _seen_moments(positions: Floats, log_weights: Floats, hidden: Floats) -> tuple[Floats, Floats, Floats]:
    features, count = log_weights.shape
    means, variances, scarce = np.zeros((features, 2)), np.zeros((features, 2)), np.empty(features)
    for n in range(features):
        weights = exponentials(log_weights[n])
        total = 0.0
        for i in range(count):
            # Hidden points have the same likelihood for all particles.
            weights[i] = max(weights[i] - hidden[n] / count, 0.0)
            total += weights[i]
        squares = 0.0
        for i in range(count):
            weights[i] = weights[i] / total if total > 0.0 else 1.0 / count
            squares += weights[i] * weights[i]
            for axis in range(2):
                means[n, axis] += weights[i] * positions[n, i, axis]
        for i in range(count):
            for axis in range(2):
                variances[n, axis] += weights[i] * (positions[n, i, axis] - means[n, axis]) ** 2
        scarce[n] = 1.0 / max(1.0 - squares, 1.0 / count)
    return means, variances, scarce
