"""What can be turned on the trackers of a solid's points: two layers, and how far each is trusted."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import field_validator

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, Value, parameter
from pftrack.experiments.shared.reports import loss_share
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance

FEATURES, MIXTURE, UPPER, SCORING = "Features", "Which prediction to trust", "Pose", "Scoring"
LAYERED = ("pf-asd", "alpha-1", "alpha-0")

AS_PUBLISHED: dict[str, Value] = {"upper_layer": "affine", "pose_band": "document"}
"""What Bando 2007 has and the defaults have not."""


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
        5,
        "Feature noise",
        "Process noise of the features' own dynamics, each frame.",
        unit="px",
        within=(0.1, 50, 0.1),
        useful=(0.5, 15),
        role="noise",
    )
    sd_floor_px: float = parameter(
        0.5,
        "Smallest deviation",
        "Standard deviation with which a feature's position is believed at the best.",
        unit="px",
        within=(0.05, 20, 0.05),
        useful=(0.05, 3),
    )
    initial_sd_px: float = parameter(
        1,
        "Initial spread",
        "Standard deviation of the particles around the features at the start.",
        unit="px",
        within=(0, 50, 0.1),
        useful=(0, 10),
        live=False,
    )
    joint_sample_count: int = joint_particles(25_000)


class _Mixture(Parameters, group=MIXTURE, trackers=("pf-asd",)):
    """How the share of each prediction follows its success."""

    forgetting: float = parameter(
        0.5,
        "Forgetting",
        "Weight of the past in adapting alpha; at 0.5 the memory is about two frames, at 1 it is all of the past.",
        within=(0, 1, 0.01),
        role="memory",
    )
    alpha_clip: float = parameter(
        0.1,
        "Clip of alpha",
        "Least share of a feature's particles that either prediction keeps.",
        within=(0.01, 0.5, 0.01),
    )
    lower_density: Literal["gaussian", "kernel"] = parameter(
        "gaussian",
        "Density of the own prediction",
        "How the own prediction is written down in adapting alpha: one Gaussian, or a kernel around each particle.",
    )


class _Upper(Parameters, group=UPPER):
    """Which camera predicts the pose, and how fast the pose may change."""

    upper_layer: Literal["perspective", "affine"] = parameter(
        "perspective",
        "Camera of the upper layer",
        "Whether the solid is predicted by pose and place before a pinhole, or by an affine camera (Bando 2007), which "
        "is wrong near the camera.",
        trackers=LAYERED,
    )
    pose_estimator: Literal["extended", "particle"] = parameter(
        "extended",
        "Pose from the affine camera",
        "Whether the angles are found by an extended Kalman filter or by particles.",
        trackers=LAYERED,
    )
    pose_sample_count: int = parameter(
        500,
        "Particles of the pose",
        "Number of particles, if the angles are found by particles.",
        within=(10, 20_000, 10),
        useful=(100, 5000),
        trackers=LAYERED,
        role="particles",
    )
    pose_noise_deg: float = parameter(
        3,
        "Pose noise",
        "How far each angle may turn in a frame, beside the affine camera.",
        unit="°",
        within=(0.05, 30, 0.05),
        useful=(0.5, 10),
        role="noise",
    )
    learned: str = parameter(
        "",
        "Learned turns",
        "How far the angles turn in a frame, and which of them together, beside the affine camera: a file that pftrack "
        "learn or the Files menu has written. It takes the place of the pose noise.",
        accept=".json",
    )
    camera_noise: float = parameter(
        1,
        "Camera noise",
        "How fast the upper layer may change, as a multiple of Bando's noise.",
        within=(0.05, 20, 0.05),
        useful=(0.05, 5),
        role="noise",
    )
    pose_band: Literal["calibrated", "document"] = parameter(
        "calibrated",
        "Band of the pose",
        "Whether the angles are as sure as the points' misfit shows, or as Bando's filters say, which is far too sure; "
        "the calibrated one takes the affine camera's error off the estimate where solid and camera are known.",
    )


class _Scoring(Parameters, group=SCORING):
    """When a pose counts as lost."""

    lost_deg: float = parameter(
        15,
        "Limit of success",
        "The pose counts as lost when it is further off than this, averaged over the axes.",
        unit="°",
        within=(0.5, 180, 0.5),
        useful=(1, 45),
    )
    lost_share: float = loss_share(0.1)


class PoseTrackerParameters(_Scoring, _Upper, _Mixture, _Features):
    """Everything that trackers of a solid's points have in common.

    Attributes:
        guidance: How the runs of the experiment are learned from.
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
        """How far a point may be from where the solid has it, px; in Bando 2007 it is there."""
        return 0.0

    @property
    def hidden_odds(self) -> float:
        """Odds that a point is hidden which looks as it should; in Bando 2007 a point that is hidden looks so."""
        return 0.0

    @property
    def speed_at_start(self) -> float:
        """How fast points may already be moving where tracking begins, px a frame; in Bando 2007 they are at rest."""
        return 0.0
