"""The methods of tracking a solid's points, of any kind, and their reports.

`pf-asd` draws each feature's particles from two predictions and adapts their shares; `alpha-1` and `alpha-0` keep to
one of them; `rb-pf` samples all features at once. A family of trackers (the prism, the head) brings the solid and the
likelihood and leaves the rest to `begin` and `advance`. The methods accept each other's beliefs, so a run can switch
methods.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.numerics.matrices import least_squares, pinhole_jacobian, product
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.core.texts import read_as
from pftrack.experiments.shared.pose import layered
from pftrack.experiments.shared.pose.calibrated import PoseTrackerParameters
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered
from pftrack.experiments.shared.pose.state import Belief, PoseState, Solid
from pftrack.filters import adaptive, rao_blackwell
from pftrack.filters.adaptive import UpperLayer
from pftrack.filters.affine import ENTRY_NOISE, AffineBelief, AffineLayer
from pftrack.filters.learning import mixture_em
from pftrack.filters.particles import ParticleSet, count_unique
from pftrack.filters.perspective import POSE_NOISE, PerspectiveLayer
from pftrack.filters.rao_blackwell import RaoBlackwell

Method: TypeAlias = Literal["pf-asd", "alpha-1", "alpha-0", "rb-pf"]

StateLikelihood: TypeAlias = Callable[[PoseState], FeatureLikelihood]
"""From a state before an observation to the observation's likelihood: what is seen depends on the pose predicted."""

RATIOS: dict[Method, float] = {"pf-asd": 0.5, "alpha-1": 1.0, "alpha-0": 0.0}

METHODS: tuple[Method, ...] = ("pf-asd", "alpha-1", "alpha-0", "rb-pf")


def begin(
    solid: Solid,
    positions: Floats,
    parameters: PoseTrackerParameters,
    method: Method,
    rng: Generator,
    *,
    theta: Gaussian | None = None,
    spread_px: float | None = None,
) -> Belief:
    """Begin with features at known positions, at rest.

    Args:
        solid: The tracked solid.
        positions: (F, 2) px of its features.
        parameters: In force.
        method: Method of tracking.
        rng: The frame's generator.
        theta: Belief in the angles (3,), rad; as certain as one frame's process noise around 0 if not given.
        spread_px: Standard deviation of the particles; that of the parameters if not given.
    """
    sd = float(np.deg2rad(parameters.pose_noise_deg))
    pose = theta or Gaussian(np.zeros(3), sd**2 * np.eye(3))
    if method == "rb-pf":
        return Belief.of_joint(_joint(solid, parameters, positions, np.zeros((len(positions), 2, 2)), pose))
    return Belief.of_layers(_begin_layers(solid, positions, parameters, method, rng, pose, spread_px))


def advance(
    state: PoseState,
    likelihood: StateLikelihood,
    parameters: PoseTrackerParameters,
    method: Method,
    rng: Generator,
) -> Belief:
    """Take one observation, given its likelihood under a state: of this one, or with the belief of a rival filter."""
    belief = state.belief
    if method == "rb-pf":
        joint, camera = belief.kept, _affine(state.solid, parameters)
        if not isinstance(joint, RaoBlackwell):
            joint = _joint(state.solid, parameters, belief.means, belief.covariances, belief.pose)
        count = parameters.joint_sample_count
        return Belief.of_joint(rao_blackwell.step(joint, camera, likelihood(state), rng, count=count))
    apart, rival = belief.kept, belief.rival
    if not isinstance(apart, Layered):
        apart = _begin_layers(state.solid, belief.means, parameters, method, rng, belief.pose)
    elif _is_affine(belief) != (parameters.upper_layer == "affine"):
        apart, rival = replace(apart, upper=_upper(state.solid, parameters, belief.means, belief.pose)), None
    layer, settings = _layer(state.solid, parameters), _settings(parameters, method)
    own, apart = likelihood(state), _steer(apart, parameters, method)
    if settings.hidden_weight == 0.0:
        return Belief.of_layers(layered.step(apart, layer, own, settings, rng))
    others = own
    if rival is not None:
        rival = replace(rival, layers=_steer(rival.layers, parameters, method))
        others = likelihood(replace(state, belief=Belief.of_layers(rival.layers)))
    return Belief.of_layers(*layered.step_rivals(apart, rival, layer, (own, others), settings, rng))


def transfer(state: PoseState, solid: Solid, parameters: PoseTrackerParameters) -> PoseState:
    """Return a state that believes the same of pose and features, but of another solid or through another camera.

    The upper layer starts again from them, at rest; it is left alone if nothing that it reads has changed.
    """
    belief, before = state.belief, state.solid
    same = np.array_equal(before.points_mm, solid.points_mm) and np.array_equal(before.reference, solid.reference)
    if isinstance(belief.kept, Layered):
        if not (same and _is_affine(belief) and parameters.upper_layer == "affine"):
            upper = _upper(solid, parameters, belief.means, belief.pose)
            belief = Belief.of_layers(replace(belief.kept, upper=upper))
    elif not same:
        belief = Belief.of_joint(_joint(solid, parameters, belief.means, belief.covariances, belief.pose))
    return replace(state, solid=solid, belief=belief)


def hold(belief: Belief) -> Belief:
    """Return a belief for a frame without a draw: each point's own particles stay the same."""
    layers = belief.kept
    if not isinstance(layers, Layered):
        return belief
    return Belief.of_layers(replace(layers, features=adaptive.hold(layers.features)), belief.rival)


def slopes(state: PoseState, parameters: PoseTrackerParameters) -> Floats:
    """Return the motion, px per mm in the solid's frame, of a point near each of its points, (F, 2, 3)."""
    belief, solid = state.belief, state.solid
    if isinstance(belief.kept, Layered) and not _is_affine(belief):
        layer = _layer(solid, parameters)
        return slopes_at(solid, layer.predict(belief.kept.upper).mean[:6])
    return np.tile(belief.camera(solid)[:, :3], (len(solid.points_mm), 1, 1))


def slopes_at(solid: Solid, q: Floats) -> Floats:
    """Return the same for a pinhole before which the solid has angles and place q (6,), rad and mm."""
    turn = rotation(q[:3])
    seen = product(solid.points_mm, turn.T) + q[3:]
    return product(pinhole_jacobian(seen, float(solid.focal_px)).reshape(-1, 3), turn).reshape(-1, 2, 3)


def has_switched(before: Belief, after: Belief) -> bool:
    """Return whether a feature went over from trusting one prediction more to trusting the other."""
    one, other = before.alpha, after.alpha
    if one is None or other is None:
        return one is not other
    return bool(((one > 0.5) != (other > 0.5)).any())


def _is_affine(belief: Belief) -> bool:
    return belief.affine is not None


def translation(turned_mm: Floats, pixels: Floats, focal_px: float, principal_px: Floats) -> Floats:
    """Return where a solid is whose pose is known, (3,) mm in the camera's frame, by least squares.

    A point seen at (u, v) from the principal point obeys f (X + t_x) = u (Z + t_z), and alike for v: linear in t.

    Args:
        turned_mm: (F, 3) R X.
        pixels: (F, 2) where the points are seen.
        focal_px: Focal length.
        principal_px: (2,).
    """
    seen = pixels - principal_px
    count = len(seen)
    slopes, wanted = np.zeros((2 * count, 3)), np.empty(2 * count)
    for axis in range(2):
        rows = slice(axis * count, (axis + 1) * count)
        slopes[rows, axis] = focal_px
        slopes[rows, 2] = -seen[:, axis]
        wanted[rows] = seen[:, axis] * turned_mm[:, 2] - focal_px * turned_mm[:, axis]
    return least_squares(slopes, wanted)[0]


def _begin_layers(
    solid: Solid,
    positions: Floats,
    parameters: PoseTrackerParameters,
    method: Method,
    rng: Generator,
    pose: Gaussian,
    spread_px: float | None = None,
) -> Layered[Any]:
    """Return layers in a solid of this pose whose features are here."""
    return layered.begin(
        _layer(solid, parameters),
        _upper(solid, parameters, positions, pose),
        positions,
        _settings(parameters, method),
        rng,
        ratio=RATIOS[method],
        spread_px=parameters.initial_sd_px if spread_px is None else spread_px,
        speed_px=parameters.speed_at_start,
    )


def _settings(parameters: PoseTrackerParameters, method: Method) -> layered.Settings:
    learning = None
    if method == "pf-asd":
        learning = mixture_em.Settings(parameters.forgetting, parameters.alpha_clip, parameters.lower_density)
    return layered.Settings(
        parameters.sample_count,
        parameters.feature_noise_px,
        parameters.sd_floor_px,
        learning,
        parameters.slack,
        parameters.hidden_odds,
    )


def _steer(apart: Layered[Any], parameters: PoseTrackerParameters, method: Method) -> Layered[Any]:
    """Return layers with ratios as the method and the present clip have them; another method may have been at work."""
    ratios = np.full(len(apart.mixture.ratios), RATIOS[method])
    if method == "pf-asd":
        ratios = np.clip(apart.mixture.ratios, parameters.alpha_clip, 1.0 - parameters.alpha_clip)
    return replace(apart, mixture=replace(apart.mixture, ratios=ratios))


def _layer(solid: Solid, parameters: PoseTrackerParameters) -> UpperLayer[Any]:
    if parameters.upper_layer == "affine":
        return _affine(solid, parameters)
    start = np.concatenate([np.zeros(3), solid.translation_mm])
    noise = parameters.pose_change * np.array(POSE_NOISE)
    return PerspectiveLayer(solid.points_mm, solid.focal_px, start, solid.principal_px, noise, solid.reach_rad)


def _affine(solid: Solid, parameters: PoseTrackerParameters) -> AffineLayer:
    return AffineLayer(
        solid.points_mm,
        solid.reference,
        parameters.camera_noise * np.array(ENTRY_NOISE),
        float(np.deg2rad(parameters.pose_noise_deg)),
        parameters.pose_estimator,
        parameters.pose_sample_count,
        parameters.walk,
    )


def _upper(
    solid: Solid, parameters: PoseTrackerParameters, positions: Floats, pose: Gaussian
) -> AffineBelief | Gaussian:
    """Return the belief of the upper layer in a solid of this pose whose features are here."""
    initial = _layer(solid, parameters).begin()
    speed_px = parameters.speed_at_start
    reach_mm = float(np.sqrt(np.square(solid.points_mm - solid.points_mm.mean(axis=0)).sum(axis=1).mean()))
    if isinstance(initial, AffineBelief):
        spread = initial.covariance
        if speed_px > 0.0:
            spread = spread.copy()
            spread[:, 4:, 4:] += np.diag(np.square([speed_px / reach_mm] * 3 + [speed_px]))
        return AffineBelief(np.tile(_camera(solid, positions, pose.mean), 2), spread, pose)
    turned = product(solid.points_mm, rotation(pose.mean).T)
    place = translation(turned, positions, solid.focal_px, solid.principal_px)
    covariance = initial.covariance.copy()
    covariance[:3, :3] = np.maximum(covariance[:3, :3], pose.covariance)
    if speed_px > 0.0:
        # The place may move by what moves the points that fast; so may a turn about their middle.
        speed_mm = speed_px * max(float(place[2]), 1.0) / solid.focal_px
        covariance[6:, 6:] += np.diag(np.square([speed_mm / reach_mm] * 3 + [speed_mm] * 3))
    return Gaussian(np.tile(np.concatenate([pose.mean, place]), 2), covariance)


def _joint(
    solid: Solid,
    parameters: PoseTrackerParameters,
    positions: Floats,
    covariances: Floats,
    pose: Gaussian,
) -> RaoBlackwell:
    """Return joint particles of a solid of this pose whose features are here, all of them at one place."""
    count = parameters.joint_sample_count
    camera = np.tile(_camera(solid, positions, pose.mean), 2)
    return replace(
        rao_blackwell.begin(_affine(solid, parameters), count),
        cameras=np.repeat(camera[:, :, None], count, axis=2),
        coordinates=np.repeat(positions.T[:, :, None], count, axis=2),
        feature_means=positions,
        feature_covariances=covariances,
        pose=pose,
    )


def _camera(solid: Solid, positions: Floats, theta: Floats) -> Floats:
    """Return the affine camera (2, 4) that sees a solid of this pose with the middle of its features in theirs."""
    slopes = product(solid.reference[:, :3], rotation(theta))
    return np.column_stack([slopes, positions.mean(axis=0) - product(slopes, solid.points_mm.mean(axis=0))])


REPORTED = read_as(Series, Path(__file__).with_name("reported.yaml"), "name")
OF_LAYERS = ("alpha", "samples", "unique_ancestors")
"""Values that joint particles lack."""


def report(method: Method, features: tuple[str, ...]) -> tuple[Series, ...]:
    """Return the series of a method that tracks a solid whose features have these names."""
    return tuple(
        replace(each, components=each.components or features) if each.shape == "vector" else each
        for each in REPORTED
        if method != "rb-pf" or each.name not in OF_LAYERS
    )


def measurement(series: tuple[Series, ...]) -> Callable[[PoseState], Mapping[str, SeriesValue]]:
    """Return a function that measures these series of a state.

    ESS and number of particles are sums over the features, where each has particles of its own. Alpha is the share of
    the solid's prediction as learned up to this frame; the samples are those of this frame. While a lost object is
    searched, its belief may still be that of the previous method, with more or fewer values than declared.
    """
    names = {one.name for one in series}

    def measure(state: PoseState) -> Mapping[str, SeriesValue]:
        weights = np.exp(state.belief.log_weights)
        return {name: value for name, value in _own_series(state.belief.kept).items() if name in names} | {
            "ess": float((1.0 / np.square(weights).sum(axis=-1)).sum()),
            "particles": float(weights.size),
            "feature_recognised": tuple(state.recognised.astype(np.float64).tolist()),
            "feature_x_px": tuple(state.feature_means[:, 0].tolist()),
            "feature_y_px": tuple(state.feature_means[:, 1].tolist()),
            "feature_sd_px": tuple(np.sqrt(np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0).tolist()),
            "switched": float(state.switched),
        }

    return measure


def _own_series(kept: Layered[Any] | RaoBlackwell | ParticleSet) -> Mapping[str, SeriesValue]:
    """Return a method's own reports: for layers alpha, particles by prediction, and the number of survivors."""
    if isinstance(kept, ParticleSet):
        return {"unique_ancestors": float(kept.unique_ancestors)}
    if isinstance(kept, RaoBlackwell):
        return {}
    features = kept.features
    upper = float(features.upper_counts.sum())
    return {
        "alpha": tuple(kept.mixture.ratios.tolist()),
        "samples": (features.log_weights.size - upper, upper),
        "unique_ancestors": float(sum(map(count_unique, features.survivors))),
    }
