"""Parameters of the trackers of a head by its eleven features, and learning of the person's face from a frame.

A user's face model, from which a growing one begins, is read, checked, and aligned with the mean face.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np
from pydantic import field_validator

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, Value, parameter
from pftrack.core.numerics.elementary import exponential
from pftrack.core.refusal import ParameterError
from pftrack.experiments.head.appearance import EYE_DISTANCE_PX
from pftrack.experiments.shared.pose import calibrated
from pftrack.experiments.shared.pose import calibrated as pose
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.face import FEATURES, FaceModel, fit_similarity, mean_model, spread_mm2
from pftrack.vision.face import FEATURES as FEATURE_NAMES
from pftrack.vision.model_files import as_json, read_points
from pftrack.vision.structure import growing
from pftrack.vision.structure.growing import Growing

# The mean face defines "frontal" and the head's origin, so a turned or moved model is turned and moved back. It must be
# a face: one of another size by half, or with a point three standard deviations of anybody's face from where the mean
# has it, is a mistake or a joke.

SIZES = (0.5, 2.0)
FURTHEST_MM = 25.0


@lru_cache(maxsize=8)
def starting_model(text: str) -> FaceModel:
    """Return the face of a file of points, as large as it is, turned and moved onto the mean face.

    Raises:
        ValueError: It is not such a file, has another number of points, or they do not form a face.
    """
    points, mean = read_points(text, FEATURES), mean_model().points_mm
    onto = fit_similarity(points, mean)
    if not SIZES[0] <= 1.0 / onto.scale <= SIZES[1]:
        raise ValueError(
            f"expected a face of {SIZES[0]:g} to {SIZES[1]:g} times the mean's size, got {1 / onto.scale:.3g}"
        )
    apart = np.sqrt(np.square(onto(points) - mean).sum(axis=1))
    worst = int(apart.argmax())
    if apart[worst] > FURTHEST_MM:
        raise ValueError(
            f"expected points within {FURTHEST_MM:g} mm of the mean face's, got {FEATURES[worst]} "
            f"{apart[worst]:.0f} mm away"
        )
    return FaceModel(onto(points) / onto.scale)


LOOK, RELIEF, LOSS = "What features look like", "Templates in relief", "A lost face"
GROWTH = "Growing face model"

AS_PUBLISHED: dict[str, Value] = {**pose.AS_PUBLISHED, "templates": "flat", "face_model": "mean", "hidden_weight": 0.0}
"""Settings of Bando 2007 that differ from the defaults."""


class _Face(Parameters, group=calibrated.UPPER):
    """Which face is followed, by which camera."""

    face_model: Literal["growing", "mean", "personal"] = parameter("growing", "Face model")
    """Whether the face grows from the mean of other people to the person's own while it is tracked, or is assumed to be
    that mean, or the person's own (on a recording, the mean face stretched over the points of the first picture)."""
    focal_widths: float = parameter(1.875, "Focal length", unit="widths", within=(0.3, 20, 0.05), useful=(0.5, 3))
    """Focal length in widths of the picture; a recording does not give it, and 1 is a usual guess."""


class _Look(Parameters, group=LOOK, constants={"templates_by_pose": False}):
    """What the features look like."""

    correlation_spread: float = parameter(
        0.15, "Correlation spread", within=(0.02, 2, 0.01), useful=(0.02, 0.5), role="sharpness"
    )
    """Scale of the distance of a patch's correlation from 1; at 0.15 a correlation of 0.5 weighs 0.004."""
    hidden_weight: float = parameter(0.5, "Odds of a hidden feature", within=(0, 2, 0.01), trackers=calibrated.LAYERED)
    """Odds that a feature is hidden which fits as well as the others; they grow as it fits worse. What is hidden is
    then where the pose has it, in place of clinging to what looks most like it. A second filter takes all features for
    visible, and the one that explains the pictures better is believed. 0 is Bando's: never hidden."""
    template_scale: float = parameter(1, "Template size", within=(0.3, 2, 0.05))
    """Size of the templates, as a multiple of Bando's for a face of this size."""
    templates: Literal["relief", "flat"] = parameter("relief", "Templates")
    """Whether features are laid onto the surface of a head and bent with it as it turns, which keeps them through fast
    and strong turns, or compared as they were seen at first (flat, Bando 2007). In relief they are not renewed."""
    template_renewal: float = parameter(0, "Template renewal", within=(0, 0.2, 0.005))
    """Rate at which templates follow the picture; they then also follow every error, so it is 0 in Bando 2007."""


class _Relief(Parameters, group=RELIEF, trackers=calibrated.LAYERED):
    """What templates in relief allow."""

    slack_px: float = parameter(8, "Slack of the features", unit="px", within=(0.5, 100, 0.5), useful=(0.5, 30))
    """With templates in relief, how far a feature may be from where the head has it: so much wider is the head's
    prediction, and features that are further away than that count for less."""
    initial_speed_px: float = parameter(8, "Initial speed", unit="px", within=(0, 100, 0.5), useful=(0, 30))
    """With templates in relief, how fast a head may already be moving where tracking begins, and where it is found
    again: the standard deviation of its features' speed, each frame."""
    pose_change_noise: float = parameter(
        1, "Change of the turn", within=(0.05, 50, 0.05), useful=(0.05, 5), role="noise"
    )
    """With templates in relief and the pinhole, how fast turning and moving may change, in place of the camera noise: a
    multiple of 1 degree and 1 mm each frame."""


DOUBT = {"recognised_correlation": 0.5, "least_recognised": 3, "largest_misfit": 0.25}
"""When a frame is doubtful, as old recipes name it; `head.trackers` has it now."""


class _Loss(Parameters, group=LOSS, constants=DOUBT):
    """When a face is lost, and found again."""

    patience_frames: int = parameter(8, "Patience", unit="frames", within=(1, 300, 1), useful=(1, 60), role="memory")
    """Frames with too few recognised features, or with features out of place, after which the face is lost."""
    find_again: bool = parameter(False, "Find again")
    """Whether a lost face is given up and looked for again; Bando does neither."""


class _Growth(Parameters, group=GROWTH, constants={"model_restarts": 0}):
    """How the face model grows."""

    model_frozen: bool = parameter(False, "Freeze the model")
    """Whether the growing face model learns no more; the frames still decide whether mean or own face is used."""
    model_memory: float = parameter(1, "Memory of the model", within=(0.5, 1, 0.001), useful=(0.9, 1), role="memory")
    """Share that the growing face model keeps of a well-seen point with each frame; 1 forgets nothing."""
    starting_face: str = parameter("", "Begin with a face model", accept=".json")
    """With which face the growing model begins: one that was exported as JSON, or the mean face if there is none."""


class HeadTrackerParameters(
    _Growth, _Loss, _Relief, _Look, _Face, calibrated.PoseTrackerParameters, group=pose.FEATURES
):
    """The trackers of a solid's points, with templates as what the points look like."""

    guidance = calibrated.pose_guidance("head")

    sample_count: int = calibrated.particles_per_feature(len(FEATURE_NAMES))
    joint_sample_count: int = calibrated.joint_particles(5000, "; Bando's 25,000 take a tenth of a second a frame")

    @property
    def pose_change(self) -> float:
        """How fast the pose before a pinhole may change, as a multiple of Bando's noise."""
        return self.camera_noise if self.templates == "flat" else self.pose_change_noise

    @property
    def slack(self) -> float:
        """Deviation of a feature from the head's prediction, px."""
        return 0.0 if self.templates == "flat" else self.slack_px

    @property
    def hidden_odds(self) -> float:
        """Odds that a feature is hidden which fits as well as the others."""
        return self.hidden_weight

    @property
    def speed_at_start(self) -> float:
        """Speed of features at the start of tracking, px a frame."""
        return 0.0 if self.templates == "flat" else self.initial_speed_px

    @field_validator("starting_face")
    @classmethod
    def _is_a_face(cls, text: str) -> str:
        """Keep only the points, unchanged, so a recipe stays short.

        Every change of any parameter comes by here again, and laid onto the mean face once more a last decimal may
        differ: that would be another face, with which the model begins again.
        """
        if not text:
            return text
        try:
            starting_model(text)
            return as_json(FEATURE_NAMES, read_points(text, FEATURE_NAMES)).decode()
        except ValueError as error:
            raise ParameterError("starting_face", text, f"a face model ({error})") from None


# The features' positions and variances are what the growing model (`pftrack.vision.structure.growing`) learns from. But
# templates of the first frame slip: the nose's template follows the nearby cheeks as the head turns, and the slip lasts
# as long as the pose. Without correction a track teaches a wrong face: with the particles' own variances the model
# ended 13 mm from the truth where the mean face is off by 3 (six simulated drivers, 210 to 212 and Bando's). A
# feature's correlation with its template shows its error: 1 px at 0.95, 2 at 0.85, 4 at 0.75, 8 at 0.6. So
#
# - the variance of a position is v / (1 - kappa), as in `pftrack.experiments.shared.pose.calibrated`, plus that of the
#   slip, whose standard deviation grows tenfold with each quarter by which the correlation falls;
# - errors that last for frames are counted as often as they are new: all variances are those of `PERSISTENCE` frames;
# - a feature that is not recognised teaches nothing, and nor does a doubtful frame, or one in which features may be
#   hidden (`pftrack.experiments.shared.pose.layered`): what a cover teaches is not the face.
#
# What is learned is used in the next frame.

PERSISTENCE = 5.0
"""For so many frames an error of a template lasts."""

SLIP_PX = 1.0
"""Standard deviation of the slip of a template that fits, for a face of Bando's size."""

SLIP_DECADES = 4.0
"""By so many powers of ten it grows as the correlation falls from 1 to 0."""

FEWEST_FEATURES = 4
"""A camera has six numbers, so three points give no information on the shape."""

LN_10 = 2.302585092994046


def begin(start: FaceModel, focal_px: float, parameters: HeadTrackerParameters) -> Growing:
    """Begin with a face, which may be off as people are from their mean."""
    return growing.begin(start.points_mm, spread_mm2(), _settings(focal_px, parameters))


def widen_motion(growth: Growing) -> Growing:
    """Return what is known of the face, for a head that may have moved anywhere since it was last seen."""
    return replace(growth, own=replace(growth.own, camera=None), mean_camera=None)


def learn(
    growth: Growing,
    state: PoseState,
    correlations: Floats,
    eye_distance_px: float,
    parameters: HeadTrackerParameters,
) -> Growing:
    """Return what is known after a frame in which the face was tracked.

    Args:
        growth: The belief so far.
        state: The frame's features.
        correlations: (F,) with their templates.
        eye_distance_px: At first sight.
        parameters: In force.
    """
    settings = _settings(state.solid.focal_px, parameters)
    growth = growth if growth.settings == settings else replace(growth, settings=settings)
    variances = position_variances(state, correlations, eye_distance_px, parameters.sd_floor_px)
    if np.isfinite(variances[:, 0]).sum() < FEWEST_FEATURES:
        return growth
    means, *_ = calibrated.seen_moments(state.belief)
    return growing.step(growth, means - state.solid.principal_px, variances)


def position_variances(state: PoseState, correlations: Floats, eye_distance_px: float, sd_floor_px: float) -> Floats:
    """Return variances (F, 2) px^2 of the features' positions, infinite where a feature is not recognised."""
    means, own, few = calibrated.seen_moments(state.belief)
    told = np.maximum(own, sd_floor_px**2)
    slip_px = SLIP_PX * eye_distance_px / EYE_DISTANCE_PX
    slip = slip_px**2 * exponential(2.0 * SLIP_DECADES * LN_10 * (1.0 - np.clip(correlations, 0.0, 1.0)))
    variances: Floats = PERSISTENCE * (told * few[:, None] + slip[:, None])
    # A sum is finite if all of its terms are.
    known = np.isfinite(variances + means + correlations[:, None]).all(axis=1)
    return np.where((state.recognised & known)[:, None], variances, math.inf)


def _settings(focal_px: float, parameters: HeadTrackerParameters) -> growing.Settings:
    return growing.Settings(float(focal_px), parameters.model_memory, frozen=parameters.model_frozen)
