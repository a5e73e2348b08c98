"""A child that says which compiled functions it has, apart from the tests: it imports this, which takes it a moment."""

import socket

from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.doctor.compiling import cases, run_case
from pftrack.experiments import EXPERIMENTS
from pftrack.process import BlockingEnd


def tell_loaded(end: socket.socket, name: str) -> None:
    """Tell which compiled functions a child has at first, and which it loads for an experiment as it is by default."""
    at_first = _loaded()
    run_case(EXPERIMENTS[name], *next(cases(EXPERIMENTS[name])))
    BlockingEnd(end).send((at_first, _loaded() - at_first))


def _loaded() -> set[str]:
    return {f"{function}{types}" for function in FUNCTIONS for types in function.signatures}
