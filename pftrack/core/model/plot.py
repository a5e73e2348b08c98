"""What a page shows of every frame in curves and in figures, declared as data.

An experiment lists its plots and its readings, as it lists its parameters; what shows them, a page or a notebook, needs
to know the kinds below and nothing of the experiment. A plot is a view of the diagnostics of the frames: of their own
columns, of the series that have a role, or of series by name. What no frame of a run has is not shown.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from pydantic import with_config

from pftrack.core.texts import CLOSED, read_as

PlotKind: TypeAlias = Literal[
    "error",
    "sigma",
    "sample size",
    "samplers",
    "innovation",
    "value",
    "band",
    "interval",
    "features",
    "frequency",
    "hypotheses",
    "tree",
]
ReadingKind: TypeAlias = Literal[
    "estimate",
    "error",
    "sigma",
    "particles",
    "samplers",
    "evidence",
    "time",
    "value",
    "interval",
    "count",
    "hypotheses",
]


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Plot:
    """A plot over the frames of a run.

    Kinds that read the diagnostics' own columns are "error", shaded where the target is hidden or lost; and "sigma",
    the largest standard deviation beside the parameters that are thresholds of "sigma". Kinds that read the series of
    a role are "sample size", of the roles "ess" and "particles"; "samplers", of the role "share"; and "innovation", of
    the roles "nis" and "nis_limit". Kinds that read series by name:

    - "value": one number a frame;
    - "band": one number a frame, within a band of two standard deviations, and the truth;
    - "interval": the ends of one or several intervals a frame, and the truth;
    - "hypotheses": one component of K hypotheses a frame, the more opaque the greater their weights, and the truth;
    - "tree": hypotheses with their parents, a row for each place among those of a frame, the more opaque the greater
      their weights, and the way back along the parents from the most probable one of the newest frame;
    - "features": a vector of numbers from 0 to 1, a row each, shaded where the feature is hidden;
    - "frequency": of flags, how many were set up to each frame, beside the `levels` where that share should be.

    Attributes:
        id: Name among the experiment's plots.
        title: What it shows, a few words; with its unit it stands above the plot.
        kind: How it is drawn.
        description: What is to be seen, one sentence.
        unit: Of what it shows; errors and standard deviations have the experiment's.
        series: Names of the series that it draws.
        sd: Of a "band", the series of standard deviations.
        truth: Of a "band", an "interval" or "hypotheses", the series of the truth.
        component: Of "hypotheses", which of the d numbers is drawn.
        shown: Of a "tree", the parameter, a whole number of the role "drawing", that says which hypothesis of the frame
            is drawn, 1 the first: to click at one is to go to its frame and to set it. Empty where none is drawn.
        visible: Of "features", the series that is 0 where the truth says that a feature is hidden.
        recognised: Of "features", the series that is 0 where the tracker itself did not make a feature out.
        row_titles: Of "features", the rows' names written out, where these are short; in their order.
        levels: Of a "frequency", where the share of each series should be, 0..1.
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
    component: int = 0
    shown: str = ""
    visible: str = ""
    recognised: str = ""
    row_titles: tuple[str, ...] = ()
    levels: tuple[float, ...] = ()
    needs_truth: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads by name."""
        return (*self.series, *(name for name in (self.sd, self.truth, self.visible, self.recognised) if name))


@dataclass(frozen=True, slots=True)
class Reading:
    """A line of figures that belongs to one frame.

    "value", a number with its standard deviation, "interval", its two ends, "hypotheses", the most probable one, and
    "count", how many flags of a vector are set, read series by name; "particles" and "samplers" read series by role;
    all others read the diagnostics' own columns.

    Attributes:
        title: What it says, one or two words.
        kind: How it is written.
        unit: Of what a series by name is measured in.
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
        """Names of all series that it reads by name."""
        return tuple(name for name in (self.series, self.sd) if name)


def read_plots(path: Path) -> Mapping[str, Plot]:
    """Return the plots of a YAML file, which maps their ids to their fields.

    Raises:
        ValueError: The file is not YAML, or a plot lacks a field or has an unknown one; it names file and line.
    """
    return {plot.id: plot for plot in read_as(Plot, path, "id")}


STANDARD_PLOTS = tuple(read_plots(Path(__file__).with_name("plots.yaml")).values())
"""The plots that suit every method: a method that has no particles, no choice between samplers, or no innovation shows
fewer."""

ERROR, SIGMA, SAMPLE_SIZE, SAMPLERS, INNOVATION = STANDARD_PLOTS

PARTICLES, STEP_TIME = Reading("particles", "particles"), Reading("step", "time")

STANDARD_READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("sigma", "sigma"),
    PARTICLES,
    Reading("proposal", "samplers"),
    Reading("log evidence", "evidence"),
    STEP_TIME,
)
"""The readings of the same."""
