"""Experiments as clients name them."""

from pftrack.core.refusal import RefusedError
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment


def find_experiment(name: str) -> Experiment:
    """Return the experiment that a client names.

    Raises:
        RefusedError: There is none of that name that can be used; the sentence lists those that there are.
    """
    try:
        return find(name)
    except LookupError as error:
        said = str(error.args[0])
        raise RefusedError(f"{said[:1].upper()}{said[1:].rstrip('.')}.", field="experiment", value=name) from None
