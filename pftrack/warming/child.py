"""The process that calls what experiments compile: cases by line on its input, news on its output.

A case is a line `["head", 3]`: an experiment's name, and the number of one of its `coverage.cases`. Each piece of news
is an object of JSON: `{"total": 81}` when it begins; `{"begun": EXPERIMENT, "cases": 12}` before the first case of one;
`{"function": NAME, "seconds": S}` for what it has compiled; at the end of a case `{"found": [NAME, ...]}`, all that is
compiled by now, and `{"done": EXPERIMENT}`, or else `{"failed": EXPERIMENT, "reason": ...}`.
"""

import json
import os
import sys
from collections.abc import Callable
from typing import TypeAlias

from pftrack.experiments import EXPERIMENTS
from pftrack.numerics.compiled import FUNCTIONS
from pftrack.process import follow_parent, leave_interrupts_to_parent
from pftrack.warming.coverage import cases, run_case
from pftrack.warming.watch import name_of, watch

LOW_PRIORITY = 10

Say: TypeAlias = Callable[[dict[str, object]], None]


def output() -> Say:
    """Return what writes a line of JSON to the standard output, and send all else that is printed to standard error.

    Experiments of other packages print, and so do libraries below Python; no line of theirs may come between the news.
    """
    lines = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def say(news: dict[str, object]) -> None:
        lines.write(json.dumps(news) + "\n")
        lines.flush()

    return say


def warm(name: str, number: int, say: Say) -> None:
    """Run a case of an experiment, and tell what came of it."""
    try:
        every = tuple(cases(EXPERIMENTS[name]))
        if number == 0:
            say({"begun": name, "cases": len(every)})
        run_case(EXPERIMENTS[name], *every[number])
    except Exception as error:  # noqa: BLE001 - foreign experiments may raise anything, and it is to be reported
        say({"failed": name, "reason": f"{type(error).__name__}: {error}".splitlines()[0]})
    else:
        say({"found": [name_of(it) for it in FUNCTIONS if it.signatures]})
        say({"done": name})


def main() -> None:
    """Run case after case until there are no more."""
    leave_interrupts_to_parent()
    follow_parent(os.getppid())
    say = output()
    if "--at-once" not in sys.argv:
        os.nice(LOW_PRIORITY)
    dict(EXPERIMENTS)
    say({"total": len(FUNCTIONS)})
    with watch(lambda _: None, lambda name, seconds: say({"function": name, "seconds": round(seconds, 3)})):
        for line in sys.stdin:
            name, number = json.loads(line)
            warm(name, number, say)


if __name__ == "__main__":
    main()
