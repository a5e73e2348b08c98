"""What compiling processes do in tests, apart from the tests: each process imports this, which takes it a moment."""

import os
import time

from pftrack.process import report


def pretend(name: str, number: int) -> list[str]:
    """Compile nothing, but report progress."""
    if number == 0:
        report({"begun": name, "cases": 2, "total": 6})
    if name == "dies" and number == 1:
        os._exit(3)
    if name == "broken":
        raise ValueError("no")
    function = f"{name}.{'ab'[number]}"
    report({"function": function, "seconds": 0.5})
    return [function]


def pause(name: str, number: int) -> list[str]:
    """Take longer than any test waits."""
    time.sleep(600)
    return pretend(name, number)


def compile_little(name: str, number: int) -> list[str]:
    """Compile two elementary functions, as if a case of the experiment called no others."""
    import numpy as np  # here, since those who pretend need nothing of it

    from pftrack.core.numerics.elementary import exponentials, logarithms
    from pftrack.doctor import compiling

    compiling.run_case = lambda *_: logarithms(exponentials(np.ones(3)))  # type: ignore[assignment]
    return compiling.compile_case(name, number)


def slow_down(name: str, number: int) -> list[str]:
    """Report functions; each takes twice as long as the one before."""
    report({"begun": name, "cases": 1, "total": 20})
    for k in range(12):
        report({"function": f"f{k}", "seconds": 2.0**k})
    return [f"f{k}" for k in range(12)]
