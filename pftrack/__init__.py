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
from importlib.util import find_spec
from pkgutil import iter_modules

from pftrack.core.numerics import machine
from pftrack.core.version import __version__

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
"""Where each name that is offered here comes from; `__init__.pyi` tells type checkers the same."""

__all__ = ["__version__", *_HOMES]  # noqa: PLE0604 - names of a dictionary are texts

# Before any library is loaded that would choose by the processor how it computes.
machine.settle()


def __getattr__(name: str) -> object:
    """Import a name, or a module of the library, when it is first asked for."""
    if name in _HOMES:
        found: object = getattr(import_module(_HOMES[name]), name)
    elif name.startswith("_") or find_spec(f"{__name__}.{name}") is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    else:
        found = import_module(f"{__name__}.{name}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """List what is offered, imported or not."""
    return [*__all__, *(each.name for each in iter_modules(__path__) if each.name[0] != "_")]
