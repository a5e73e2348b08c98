"""An experiment with trackers of files that are named and not executed, for whoever plans runs and computes none.

A server knows which files its owner has named, but their texts are executed in confined processes alone. What it shows
of a plan, titles, measures and parameters of the experiment, needs no text. Parameters of the files are not known here.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NoReturn

from pftrack.core.model.tracker import Tracker
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.errors import FilterFileError
from pftrack.experiments.own.tracker import series_of

__all__ = ["outline"]


def outline(experiment_id: str, names: Iterable[str]) -> Experiment:
    """Return an experiment with trackers of these names, none of which can take a step.

    Raises:
        LookupError: There is none of that name that can be used.
        FilterFileError: The experiment takes no filters from files.
    """
    return _outline(experiment_id, tuple(names))


@lru_cache(maxsize=64)
def _outline(experiment_id: str, names: tuple[str, ...]) -> Experiment:
    experiment = find(experiment_id)
    if not names:
        return experiment
    interface = experiment.filter_interface
    if interface is None:
        raise FilterFileError(f"{names[0]}.py", None, f"{experiment.id} takes no filters from files")

    def named(name: str) -> Tracker:
        def refuse(*_: Any) -> NoReturn:  # noqa: ANN401 - as of `Tracker`
            raise FilterFileError(f"{name}.py", None, "it is named here and not executed")

        title = f"{name}.py"
        return Tracker(name, title, f"{title}.", refuse, refuse, series=series_of(interface), reads=(interface.reads,))

    return replace(experiment, trackers={**experiment.trackers, **{name: named(name) for name in names}})
