"""pftrack: interactive tracking experiments with particle filters.

Data flows one way, `Source -> Tracker -> Run -> Drawing`, and parameters flow the other way through one door
(`pftrack.core.model.parameters.revise`). The library knows nothing of the web; the server is another package.

    >>> import pftrack
    >>> run = pftrack.run("ball", seed=3)
    >>> run.export("ball.csv")

`run` computes a run, `load` opens one that was saved, `record` writes what a loop of your own believes, `compare` puts
runs beside each other, `fit` finds noises that suit what was seen, `show` opens the scene of one, and `filter` runs a
model of your own on data of your own.
They are imported when they are first asked for, so that `import pftrack` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from pftrack.core.numerics import machine
from pftrack.core.version import __version__

if TYPE_CHECKING:
    from pftrack.analysis.fitting import fit
    from pftrack.api import compare, load, record, run
    from pftrack.core.model.model import Model
    from pftrack.core.model.recipe import Recipe
    from pftrack.core.numerics.compiled import compiled
    from pftrack.experiments.experiment import Experiment
    from pftrack.experiments.own.code import slider
    from pftrack.filters.alone import filter  # noqa: A004 - as users call it
    from pftrack.output.exports.formats import show
    from pftrack.runs.comparison import Comparison
    from pftrack.runs.run import Run

__all__ = [
    "Comparison",
    "Experiment",
    "Model",
    "Recipe",
    "Run",
    "__version__",
    "compare",
    "compiled",
    "filter",
    "fit",
    "load",
    "record",
    "run",
    "show",
    "slider",
]

_HOMES = {
    "Comparison": "pftrack.runs.comparison",
    "Experiment": "pftrack.experiments.experiment",
    "Model": "pftrack.core.model.model",
    "Recipe": "pftrack.core.model.recipe",
    "Run": "pftrack.runs.run",
    "compare": "pftrack.api",
    "compiled": "pftrack.core.numerics.compiled",
    "filter": "pftrack.filters.alone",
    "fit": "pftrack.analysis.fitting",
    "load": "pftrack.api",
    "record": "pftrack.api",
    "run": "pftrack.api",
    "show": "pftrack.output.exports.formats",
    "slider": "pftrack.experiments.own.code",
}
"""Where each name that is offered here comes from."""

# Before any library is loaded that would choose by the processor how it computes.
machine.settle()


def __getattr__(name: str) -> object:
    """Import a name when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """List what is offered, imported or not."""
    return list(__all__)
