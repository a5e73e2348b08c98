"""What can be set on trackers that draw by prediction and by observation; each class names its readers."""

from typing import Any, Literal, Self, TypeAlias

from pydantic import model_validator

from pftrack.core.model.parameters import ParameterError, Parameters, parameter
from pftrack.experiments.shared.reports import particle_count, resampling_threshold
from pftrack.filters.auxiliary import WeightRule

DRAWING = ("condensation", "apf", "pc-pf", "h-spf", "s-spf")
OBSERVING = ("apf", "h-spf", "s-spf")

SAMPLING = "Sampling"
SWITCHING = "Switching thresholds"

Resampling: TypeAlias = Literal["systematic", "stratified", "residual", "multinomial"]


def velocity_retention() -> Any:  # noqa: ANN401 - a field declaration
    """Declare how much of a velocity stays."""
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
    apf_weights: WeightRule = parameter(
        "sharpened",
        "Observation weights",
        "Weight of a particle whose parent was chosen by the observation: sharpened as in Bando 2007 (not a valid "
        "importance sampler), corrected by Pitt and Shephard's rule, or corrected with the balance heuristic.",
        trackers=OBSERVING,
    )
    resampling: Resampling = parameter("systematic", "Resampling", "How parents are drawn.", role="resampling")
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
