"""The methods by which a solid's points are tracked, whatever they look like.

`pf-asd` draws each feature's particles from two predictions and adapts their shares; `alpha-1` and `alpha-0` keep to
one of them; `rb-pf` samples all features at once. A family of trackers (`prism`, `head`) brings the solid and the
likelihood and leaves the rest to `begin` and `advance`. The methods understand each other's beliefs, so that one may
take over from another in mid-run.
"""

from dataclasses import replace
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.elementary import exponentials
from pftrack.filters import adaptive, rao_blackwell
from pftrack.filters.affine import ENTRY_NOISE, AffineBelief, AffineLayer
from pftrack.filters.layers import UpperLayer
from pftrack.filters.perspective import POSE_NOISE, PerspectiveLayer
from pftrack.filters.rao_blackwell import RaoBlackwell
from pftrack.gaussian import Gaussian
from pftrack.geometry.camera import affine_fit
from pftrack.geometry.rotation import rotation
from pftrack.learning import mixture_em
from pftrack.random import Generator
from pftrack.trackers import layered
from pftrack.trackers.layered import FeatureLikelihood, Layered
from pftrack.trackers.pose_parameters import PoseTrackerParameters
from pftrack.trackers.pose_state import PoseState, Solid

__all__ = ["METHODS", "Belief", "Method", "advance", "begin", "pose_of", "switched", "translation"]

Method: TypeAlias = Literal["pf-asd", "alpha-1", "alpha-0", "rb-pf"]
Belief: TypeAlias = Layered[Any] | RaoBlackwell

RATIOS: dict[Method, float] = {"pf-asd": 0.5, "alpha-1": 1.0, "alpha-0": 0.0}

METHODS: dict[Method, tuple[str, str]] = {
    "pf-asd": (
        "Adaptive sampling (PF-ASD)",
        "Draws each feature's particles from the solid's pose and from its own past, and learns how many of each.",
    ),
    "alpha-1": ("Solid only (alpha 1)", "Draws all particles of a feature where the solid's pose says it should be."),
    "alpha-0": ("Features only (alpha 0)", "Draws all particles of a feature from its own past."),
    "rb-pf": (
        "Rao-Blackwellised (RB-PF)",
        "Draws all features at once, with an exact Kalman filter of the camera in each particle; slow.",
    ),
}
"""Title and description by method."""


def begin(
    solid: Solid, positions: NDArray[np.float64], parameters: PoseTrackerParameters, method: Method, rng: Generator
) -> Belief:
    """Begin with features at known positions (F, 2) px and the pose theta = 0."""
    if method == "rb-pf":
        return rao_blackwell.begin(_affine(solid, parameters), parameters.joint_sample_count)
    layer = _layer(solid, parameters)
    settings = _settings(parameters, method)
    return layered.begin(
        layer, layer.begin(), positions, settings, rng, ratio=RATIOS[method], spread_px=parameters.initial_sd_px
    )


def advance(
    state: PoseState,
    log_likelihood: FeatureLikelihood,
    parameters: PoseTrackerParameters,
    method: Method,
    rng: Generator,
) -> Belief:
    """Take one observation, given its likelihood."""
    belief = state.belief
    if method == "rb-pf":
        layer = _affine(state.solid, parameters)
        joint = belief if isinstance(belief, RaoBlackwell) else _joined(belief, state, layer, parameters)
        return rao_blackwell.step(joint, layer, log_likelihood, rng, count=parameters.joint_sample_count)
    if isinstance(belief, RaoBlackwell):
        belief = _split(belief, state, parameters, rng)
    belief = replace(belief, mixture=_steered(belief.mixture, parameters, method))
    settings = _settings(parameters, method)
    return layered.step(belief, _layer(state.solid, parameters), log_likelihood, settings, rng)


def pose_of(belief: Belief) -> Gaussian:
    """Return the belief in the angles, rad."""
    return belief.pose


def switched(before: Belief, after: Belief) -> bool:
    """Return whether a feature went over from trusting one prediction more to trusting the other."""
    if isinstance(before, RaoBlackwell) or isinstance(after, RaoBlackwell):
        return type(before) is not type(after)
    return bool(((before.mixture.ratios > 0.5) != (after.mixture.ratios > 0.5)).any())


def translation(
    turned_mm: NDArray[np.float64], pixels: NDArray[np.float64], focal_px: float, principal_px: NDArray[np.float64]
) -> NDArray[np.float64]:
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
    return np.asarray(np.linalg.lstsq(slopes, wanted, rcond=None)[0], dtype=np.float64)


def _settings(parameters: PoseTrackerParameters, method: Method) -> layered.Settings:
    learning = None
    if method == "pf-asd":
        learning = mixture_em.Settings(parameters.forgetting, parameters.alpha_clip, parameters.lower_density)
    return layered.Settings(parameters.sample_count, parameters.feature_noise_px, parameters.sd_floor_px, learning)


def _steered(mixture: mixture_em.Mixture, parameters: PoseTrackerParameters, method: Method) -> mixture_em.Mixture:
    """Return the ratios as the method and the present clip have them; another method may have been at work before."""
    if method == "pf-asd":
        return replace(mixture, ratios=np.clip(mixture.ratios, parameters.alpha_clip, 1.0 - parameters.alpha_clip))
    return replace(mixture, ratios=np.full(len(mixture.ratios), RATIOS[method]))


def _layer(solid: Solid, parameters: PoseTrackerParameters) -> UpperLayer[Any]:
    if parameters.upper_layer == "affine":
        return _affine(solid, parameters)
    start = np.concatenate([np.zeros(3), solid.translation_mm])
    noise = parameters.camera_noise * np.array(POSE_NOISE)
    return PerspectiveLayer(solid.points_mm, solid.focal_px, start, solid.principal_px, noise)


def _affine(solid: Solid, parameters: PoseTrackerParameters) -> AffineLayer:
    return AffineLayer(
        solid.points_mm,
        solid.reference,
        parameters.camera_noise * np.array(ENTRY_NOISE),
        float(np.deg2rad(parameters.pose_noise_deg)),
        parameters.pose_estimator,
        parameters.pose_sample_count,
    )


def _joined(
    belief: Layered[Any], state: PoseState, layer: AffineLayer, parameters: PoseTrackerParameters
) -> RaoBlackwell:
    """Begin joint particles where the features and the pose are."""
    count = parameters.joint_sample_count
    fresh = rao_blackwell.begin(layer, count)
    camera = affine_fit(state.solid.points_mm, belief.features.means)
    return replace(
        fresh,
        cameras=np.repeat(np.tile(camera, 2)[:, :, None], count, axis=2),
        coordinates=np.repeat(belief.features.means.T[:, :, None], count, axis=2),
        feature_means=belief.features.means,
        feature_covariances=belief.features.covariances,
        pose=belief.pose,
    )


def _split(belief: RaoBlackwell, state: PoseState, parameters: PoseTrackerParameters, rng: Generator) -> Layered[Any]:
    """Begin features of their own where those of the joint particles are."""
    layer, solid = _layer(state.solid, parameters), state.solid
    upper = layer.begin()
    if isinstance(upper, AffineBelief):
        weights = exponentials(belief.log_weights)
        covariance = np.stack([belief.covariance, belief.covariance]) + upper.covariance
        upper = AffineBelief(belief.cameras @ weights, covariance, belief.pose)
    else:
        turned = solid.points_mm @ rotation(belief.pose.mean).T
        place = translation(turned, belief.feature_means, solid.focal_px, solid.principal_px)
        upper = Gaussian(np.tile(np.concatenate([belief.pose.mean, place]), 2), upper.covariance)
    features = adaptive.begin(belief.feature_means, 1.0, parameters.sample_count, rng)
    mixture = mixture_em.begin(len(features.means), 0.5)
    return Layered(features, upper, mixture, belief.pose)
