"""What a page shows of every frame in curves and in figures, declared as data.

An experiment lists its plots and its readings, as it lists its parameters; whoever shows them, a page or a notebook,
needs to know the kinds below and nothing of the experiment. What is drawn comes from the diagnostics of the frames:
from their own columns, or from the experiment's series by name.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

__all__ = [
    "ERROR",
    "PARTICLES",
    "SAMPLE_SIZE",
    "STANDARD_PLOTS",
    "STANDARD_READINGS",
    "STEP_TIME",
    "Plot",
    "PlotKind",
    "Reading",
    "ReadingKind",
]

PlotKind: TypeAlias = Literal["error", "sigma", "sample size", "proposals", "band", "features", "share"]
ReadingKind: TypeAlias = Literal[
    "estimate", "error", "sigma", "particles", "proposal", "evidence", "time", "value", "count"
]


@dataclass(frozen=True, slots=True)
class Plot:
    """A plot over the frames of a run.

    Kinds that read the diagnostics' own columns are "error", shaded where the target is hidden or lost; "sigma", the
    largest standard deviation beside the tracker's thresholds; "sample size"; and "proposals". Kinds that read series:

    - "band": one number a frame, within a band of two standard deviations, and the truth;
    - "features": one number from 0 to 1 for each feature, a row each, shaded where the feature is hidden;
    - "share": of series of zeros and ones, how many were ones up to each frame, beside the `levels` where that share
      should be.

    Attributes:
        id: Name among the experiment's plots.
        title: What it shows, a few words; with its unit it stands above the plot.
        kind: How it is drawn.
        description: What is to be seen, one sentence.
        unit: Of what a "band" shows; errors and standard deviations have the experiment's, all others none.
        series: Names of the series that it draws.
        sd: Of a "band", the series of standard deviations.
        truth: Of a "band", the series of the truth.
        visible: Of "features", the series that is 0 where the truth says that a feature is hidden.
        recognised: Of "features", the series that is 0 where the tracker itself did not make a feature out.
        levels: Of a "share", where the share of each series should be, 0..1.
        needs_truth: Whether there is nothing to draw where the truth is unknown.
    """

    id: str
    title: str
    kind: PlotKind
    description: str
    unit: str = ""
    series: tuple[str, ...] = ()
    sd: str = ""
    truth: str = ""
    visible: str = ""
    recognised: str = ""
    levels: tuple[float, ...] = ()
    needs_truth: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads."""
        return (*self.series, *(name for name in (self.sd, self.truth, self.visible, self.recognised) if name))


@dataclass(frozen=True, slots=True)
class Reading:
    """A line of figures that belongs to one frame.

    The kinds "value", a number with its standard deviation, and "count", how many of the features have a 1, read
    series; all others read the diagnostics' own columns.

    Attributes:
        title: What it says, one or two words.
        kind: How it is written.
        unit: Of a "value".
        series: Name of the series that it writes.
        sd: Of a "value", the series of standard deviations.
    """

    title: str
    kind: ReadingKind
    unit: str = ""
    series: str = ""
    sd: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads."""
        return tuple(name for name in (self.series, self.sd) if name)


ERROR = Plot(
    "error",
    "error",
    "error",
    "How far the estimate is from the truth; grey where the target is hidden, red where it is lost.",
    needs_truth=True,
)
SAMPLE_SIZE = Plot(
    "ess",
    "ESS",
    "sample size",
    "Effective sample size: how many particles carry the weight, of how many there are.",
)

STANDARD_PLOTS = (
    ERROR,
    Plot(
        "sigma",
        "sigma",
        "sigma",
        "The largest standard deviation of the posterior, and dashed the thresholds at which the tracker switches.",
    ),
    SAMPLE_SIZE,
    Plot("proposals", "proposals", "proposals", "How many particles came from the prediction and the observation."),
)
"""The plots of a tracker that draws by prediction and by observation."""

PARTICLES, STEP_TIME = Reading("particles", "particles"), Reading("step", "time")

STANDARD_READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("sigma", "sigma"),
    PARTICLES,
    Reading("proposal", "proposal"),
    Reading("log evidence", "evidence"),
    STEP_TIME,
)
"""The readings of the same."""
