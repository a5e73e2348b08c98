"""Files to begin with: a filter that works for each experiment that takes filters from files."""

from importlib.resources import files

from pftrack.experiments.experiment import Experiment

__all__ = ["example_of"]


def example_of(experiment: Experiment) -> str:
    """Return the text of a filter for an experiment.

    Raises:
        ValueError: It takes none.
    """
    if experiment.filter_interface is None:
        raise ValueError(f"{experiment.id} takes no filters from files")
    package, _, module = experiment.filter_interface.example.rpartition(".")
    return (files(package) / f"{module}.py").read_text(encoding="utf-8")
