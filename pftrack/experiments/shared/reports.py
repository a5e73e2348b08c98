"""Common declarations of several families of trackers: reported series, parameters, and the state of a single point.

The state is a posterior over the vector of one point, or of one signal, by particles or a Gaussian.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

from pydantic import model_validator

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.likelihood import Cloud
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.numerics.random import Gaussian
from pftrack.core.refusal import ParameterError
from pftrack.core.texts import read_as
from pftrack.filters.auxiliary import WeightRule
from pftrack.filters.dynamics import Lineage
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.learning.online_em import Learner
from pftrack.filters.particles import ParticleSet

_DECLARED = {series.name: series for series in read_as(Series, Path(__file__).with_name("series.yaml"), "name")}
CLOUD = tuple(_DECLARED[name] for name in ("ess", "particles", "resampled", "unique_ancestors"))
SAMPLERS, ALERT, EXACT = _DECLARED["samples"], _DECLARED["switched"], _DECLARED["exact"]
NIS = tuple(_DECLARED[name] for name in ("nis", "nis_freedom", "nis_limit"))
"""Series of many trackers; `series.yaml` lists the trackers."""


def cloud(particles: ParticleSet, *, resampled: bool) -> Mapping[str, SeriesValue]:
    """Return the values of `CLOUD`."""
    return {
        "ess": particles.effective_sample_size,
        "particles": float(len(particles)),
        "resampled": float(resampled),
        "unique_ancestors": float(particles.unique_ancestors),
    }


def hypotheses_cloud(states: Floats, log_weights: Floats, parents: Ints) -> Cloud:
    """Return the members of a beam, laid open like particles: states (K, d), log weights (K,), parents (K,).

    Where all particles are new, as after a switch of trackers, their ancestors are unknown.
    """
    return Cloud(states, log_weights, None if (parents < 0).all() else parents)


LEARNED_MOTION = "Learned motion"


def particle_count(default: int, *, trackers: tuple[str, ...] | None = None) -> Any:  # noqa: ANN401 - as of `parameter`
    """Declare the number of particles of filters with one set of them."""
    return parameter(
        default,
        "Particles",
        "Number of particles N.",
        within=(1, 100_000, 1),
        useful=(10, 3000),
        trackers=trackers,
        role="particles",
    )


def resampling_threshold(*, trackers: tuple[str, ...] | None = None) -> Any:  # noqa: ANN401
    """Declare when filters resample that need not do so in every frame."""
    return parameter(
        1.0,
        "Resampling threshold",
        "Resample only when the effective sample size is below this share of N; 1 resamples in every frame.",
        within=(0, 1, 0.05),
        trackers=trackers,
        role="resampling",
    )


def loss_share(default: float) -> Any:  # noqa: ANN401
    """Declare the largest lost share of a successful run, for trackers of targets that can be lost."""
    return parameter(
        default,
        "Frames that may be lost",
        "A run is a success if no more than this share of its frames with known truth is lost.",
        within=(0, 1, 0.01),
        role="loss_share",
    )


class JudgedByBox(Parameters, group="Scoring"):
    """Trackers of a recording with true boxes: the target is held inside the box, else lost.

    All these experiments share one threshold (`pftrack.core.model.measures.HELD_WITHIN`), and the measure
    `inside_share` decides on success by it.
    """

    lost_share: float = parameter(0.25, "Frames that may miss", within=(0, 1, 0.01), role="loss_share")
    """A run is a success if the estimate lies outside the true box in no more than this share of the frames with known
    truth."""

    @property
    def judged_by_box(self) -> bool:
        """Whether a true box, where one is known, decides whether the target is lost."""
        return True


def learned_motion(*, trackers: tuple[str, ...] | None = None) -> Any:  # noqa: ANN401
    """Declare the file by which particles are guided; the model that has it refuses what its `Guidance` refuses."""
    return parameter(
        "",
        "Learned motion",
        "How motion and shape change, which guides the particles: a file that pftrack learn or Export and import has "
        "written, or what comes with the experiment if there is none.",
        accept=".json",
        trackers=trackers,
    )


def diffusion_scale(*, trackers: tuple[str, ...] | None = None) -> Any:  # noqa: ANN401
    """Declare how wide the learned diffusion is."""
    return parameter(
        1.0,
        "Width of the diffusion",
        "Factor of all standard deviations of the learned changes.",
        within=(0.05, 20, 0.05),
        useful=(0.1, 4),
        trackers=trackers,
        role="noise",
    )


def correlated_changes(*, trackers: tuple[str, ...] | None = None) -> Any:  # noqa: ANN401
    """Declare whether the learned correlations are used."""
    return parameter(
        True,
        "Correlated changes",
        "Whether changes of motion and shape are drawn together as they were learned, or each by itself with the same "
        "standard deviation.",
        trackers=trackers,
    )


# Parameters of trackers that draw by prediction and by observation; each class names its readers.

DRAWING = ("condensation", "apf", "pc-pf", "h-spf", "s-spf")
OBSERVING = ("apf", "h-spf", "s-spf")

SAMPLING = "Sampling"
SWITCHING = "Switching thresholds"

Resampling: TypeAlias = Literal["systematic", "stratified", "residual", "multinomial"]


def velocity_retention() -> Any:  # noqa: ANN401 - a field declaration
    """Declare the share of a velocity that is kept."""
    return parameter(
        1.0,
        "Velocity retention",
        "Share of the velocity kept from frame to frame: 1 is constant velocity, 0 a random walk.",
        within=(0, 1, 0.05),
        role="memory",
    )


def large_process_noise() -> Any:  # noqa: ANN401 - a field declaration
    """Declare the noise on the position of those that switch to a larger one, px."""
    return parameter(
        5,
        "Large process noise",
        "Process noise of the position while the posterior is wider than gamma.",
        unit="px",
        within=(0.01, 200, 0.1),
        useful=(0.5, 30),
        trackers=("pc-pf",),
        role="noise",
    )


class SamplingParameters(Parameters, group=SAMPLING, trackers=DRAWING):
    """How particles are drawn."""

    sample_count: int = particle_count(800)
    apf_weights: WeightRule = parameter("sharpened", "Observation weights", trackers=OBSERVING)
    """Weight of a particle whose parent was chosen by the observation: sharpened as in Bando 2007 (not a valid
    importance sampler), corrected by Pitt and Shephard's rule, or corrected with the balance heuristic."""
    resampling: Resampling = parameter("systematic", "Resampling", role="resampling")
    """How parents are drawn."""
    resampling_threshold: float = resampling_threshold(trackers=("condensation", "pc-pf", "h-spf", "s-spf"))


def gamma(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the threshold of those that switch hard, px."""
    return _threshold(
        default,
        "Threshold gamma",
        "A posterior standard deviation above this switches to the observation sampler, or to the large process noise.",
        ("h-spf", "pc-pf"),
    )


def gamma_min(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the lower threshold of those that switch softly, px."""
    return _threshold(
        default,
        "Lower threshold",
        "Up to this posterior standard deviation no particle is drawn by observation.",
        ("s-spf",),
    )


def gamma_max(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the upper threshold of those that switch softly, px."""
    return _threshold(
        default,
        "Upper threshold",
        "From this posterior standard deviation on all particles are drawn by observation.",
        ("s-spf",),
    )


def _threshold(default: float, title: str, description: str, trackers: tuple[str, ...]) -> Any:  # noqa: ANN401
    return parameter(
        default,
        title,
        description,
        unit="px",
        within=(0, 1000, 0.5),
        useful=(0, 40),
        trackers=trackers,
        role="threshold",
        threshold_of="sigma",
    )


class SwitchingParameters(Parameters, group=SWITCHING):
    """When another sampler, or another process noise, is used."""

    gamma_px: float = gamma(5)
    gamma_min_px: float = gamma_min(4)
    gamma_max_px: float = gamma_max(20)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.gamma_min_px > self.gamma_max_px:
            raise ParameterError("gamma_min_px", self.gamma_min_px, f"at most gamma_max_px ({self.gamma_max_px:g} px)")
        return self


@dataclass(frozen=True, slots=True)
class PointState:
    """The posterior of one frame, immutable.

    Attributes:
        posterior: Mean and covariance of the whole state (d,); its first `tracked` coordinates are the estimate.
        tracked: Number of coordinates of the estimate.
        particles: The posterior as particles, or None for a Gaussian filter.
        observation_count: Number of particles from the observation sampler; they are the last ones.
        samplers: Names of what draws by prediction and by observation, where there is a choice.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether the particles were resampled in this frame.
        switched: Whether another sampler, or another process noise, was used than in the frame before.
        alert: Whether the tracker trusts the observation more, or doubts the prediction more, than in calm times; None
            before the first step.
        learner: The learned dynamics, if they are learned.
        lineage: The particles' pasts, if the path is to be smoothed.
        reference: The exact posterior, where known.
        innovation: The innovation of the frame, for a Gaussian filter with a measurement.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    posterior: Gaussian
    tracked: int
    particles: ParticleSet | None = None
    observation_count: int = 0
    log_evidence: float = 0.0
    resampled: bool = False
    switched: bool = False
    alert: bool | None = None
    learner: Learner | None = None
    lineage: Lineage | None = None
    reference: Gaussian | None = None
    innovation: NormalisedInnovation | None = None
    repeatable: bool = True
    samplers: tuple[str, ...] = ()

    @property
    def estimate(self) -> Floats:
        """(tracked,) posterior mean."""
        return self.posterior.mean[: self.tracked]

    @property
    def sigma(self) -> Floats:
        """(tracked,) posterior standard deviations."""
        return self.posterior.standard_deviations[: self.tracked]

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles; empty without."""
        return self.particles.arrays() if self.particles is not None else {}
