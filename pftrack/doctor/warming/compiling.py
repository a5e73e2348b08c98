"""What a process does that compiles: it runs a case of an experiment, and tells what it has compiled on the way.

Each piece of news is a dictionary: `{"begun": EXPERIMENT, "cases": 12, "total": 81}` before the first case of one, with
the number of all functions that there are, and `{"function": NAME, "seconds": S}` for what it has compiled.
"""

from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.doctor.warming.coverage import cases, run_case
from pftrack.doctor.warming.watch import name_of, watch
from pftrack.experiments import EXPERIMENTS
from pftrack.process import report

__all__ = ["compile_case"]


def compile_case(name: str, number: int) -> list[str]:
    """Run one of the `coverage.cases` of an experiment, and return the names of all that is compiled by then."""
    every = tuple(cases(EXPERIMENTS[name]))
    if number == 0:
        report({"begun": name, "cases": len(every), "total": len(FUNCTIONS)})
    with watch(lambda _: None, lambda function, seconds: report({"function": function, "seconds": round(seconds, 3)})):
        run_case(EXPERIMENTS[name], *every[number])
    return [name_of(it) for it in FUNCTIONS if it.signatures]
