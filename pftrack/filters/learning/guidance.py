"""Guidance: that an experiment's recorded states can be learned from, and its particles be guided by what was learned.

An experiment whose states have a place, a heading or a shape declares how they are to be read (`Guidance`). From that
alone `pftrack learn` and a session's menu of files learn from its runs (`pftrack.filters.learning.diffusion`). The text
of a learned file is the value of a parameter of its trackers (`pftrack.experiments.shared.reports.learned_motion`),
so that a run, a sweep, a session and a share link carry it whole.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.setup import Export, ExportError
from pftrack.core.numerics.random import Generator
from pftrack.filters.learning.charts import Chart, Reading, advance_states
from pftrack.filters.learning.diffusion import Diffusion, Learned, LearnedError, learn

if TYPE_CHECKING:
    from pftrack.core.model.diagnostics import Diagnostics


@dataclass(frozen=True)
class Guidance:
    """How an experiment's runs are learned from.

    Attributes:
        experiment: Its name.
        chart: What the numbers of a recorded state are.
        built_in: Text of the learned file that is used where there is no other.
        parameter: Name of the parameter whose value is the text of a learned file.
        series: Name of the vector of numbers that a row's recorded state is; empty for the estimate.
        scale: What a row's numbers are divided by to be in the chart's units; 180/pi for angles in degrees.
    """

    experiment: str
    chart: Chart
    built_in: str
    parameter: str = "learned"
    series: str = ""
    scale: float = 1.0

    def parse(self, text: str) -> Learned:
        """Return what a file says that was learned; of an empty text, what is built in.

        Raises:
            ParameterError: It is no learned file, or one of another experiment, chart or version.
        """
        try:
            return _read(text or self.built_in, self.experiment, self.chart)
        except LearnedError as error:
            raise ParameterError(self.parameter, text, f"a learned motion ({error})") from None

    def states(self, rows: Sequence["Diagnostics"]) -> Floats:
        """Return the recorded states of a run (L, d), NaN where the target was lost or looked for.

        A person who learns from tracks looks them through first; where the truth is known, it does that.

        Raises:
            LearnedError: A row holds another number of values than a state has.
        """
        states = np.full((len(rows), len(self.chart.names)), np.nan)
        for frame, row in enumerate(rows):
            recorded = row.vector(self.series) if self.series else row.estimate
            if recorded is not None and len(recorded) != states.shape[1]:
                raise LearnedError(
                    f"frame {row.frame} must hold a state of {', '.join(self.chart.names)} to learn from, "
                    f"{states.shape[1]} numbers, got {len(recorded)}"
                )
            if recorded is not None and not row.searching and not row.is_lost:
                states[frame] = np.array(recorded) / self.scale
        return states

    def saved_states(self, columns: Mapping[str, NDArray[Any]], name: str) -> Floats:
        """Return the same of the columns of a saved run, given the name of its file.

        Raises:
            LearnedError: The file has no such states.
        """
        recorded = columns.get(f"series_{self.series}" if self.series else "estimate")
        wanted = len(self.chart.names)
        if recorded is None or recorded.dtype.kind != "f" or recorded.shape[1:] != (wanted,):
            raise LearnedError(f"{name} holds no states of {', '.join(self.chart.names)} to learn from; save it again")
        states: Floats = np.array(recorded, np.float64) / self.scale
        for gone in (columns.get("lost"), columns.get("searching")):
            if gone is not None and gone.shape == states.shape[:1]:
                states[gone == 1] = np.nan
        return states

    def learn(self, tracks: Iterable[Floats]) -> Learned:
        """Return what the recorded states of one or several runs teach.

        Raises:
            LearnedError: They are too few, or something never changes in them.
        """
        return learn(tracks, self.chart, self.experiment)

    @property
    def export(self) -> Export:
        """The file that is learned from the run as far as it was computed."""
        return Export("learned", "Learned motion", "learned.json", "application/json", partial(_export, self))


def _export(guidance: Guidance, state: Any, rows: Sequence["Diagnostics"]) -> bytes:  # noqa: ANN401 - of any tracker
    del state
    try:
        return guidance.learn([guidance.states(rows)]).text.encode()
    except LearnedError as error:
        raise ExportError(str(error)) from None


@lru_cache(maxsize=32)
def _read(text: str, experiment: str, chart: Chart) -> Learned:
    return Learned.read(text, experiment=experiment, chart=chart)


@dataclass(frozen=True, eq=False)
class GuidedDynamics:
    """p(x' | x) by which motion and shape change as they did in recorded tracks.

    Attributes:
        diffusion: The changes.
        chart: What they change; a state is the place, its velocity, then heading, angles and numbers.
        reading: In which frame a place changes.
    """

    diffusion: Diffusion
    chart: Chart
    reading: Reading

    def predict(self, states: Floats) -> Floats:
        """Return the states (N, D) as they are: the drawn turn decides which way the velocity moves them."""
        return states

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, D) of the ancestors (n,) chosen among the states (N, D)."""
        normals = rng.standard_normal((len(self.diffusion.mean), len(ancestors)))
        return advance_states(
            means, ancestors, normals, self.diffusion.root, self.diffusion.mean, self.chart, self.reading
        )
