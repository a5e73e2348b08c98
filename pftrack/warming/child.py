"""The process that calls everything that an experiment compiles: experiments by line on its input, news on its output.

Each piece of news is a line of JSON: `{"total": 81}` when it begins, `{"function": NAME, "seconds": S}` for what it has
compiled, `{"found": [NAME, ...]}` for what was compiled before, `{"ready": EXPERIMENT}` or `{"failed": EXPERIMENT,
"reason": ...}` at the end of each.
"""

import json
import os
import sys
from collections.abc import Callable
from typing import TypeAlias

from pftrack.compiled import FUNCTIONS
from pftrack.experiments import EXPERIMENTS
from pftrack.process import follow_parent, leave_interrupts_to_parent
from pftrack.warming.coverage import cases, run_case
from pftrack.warming.memory import remember
from pftrack.warming.watch import loaded, name_of, watched

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


def warm(name: str, say: Say) -> None:
    """Run everything of an experiment, and tell what came of it."""
    loading: dict[int, frozenset[str]] = {}
    try:
        for number, (tracker, values) in enumerate(cases(EXPERIMENTS[name])):
            before = loaded()
            run_case(EXPERIMENTS[name], tracker, values)
            if new := loaded() - before:
                loading[number] = new
            say({"found": [name_of(it) for it in FUNCTIONS if it.signatures]})
    except Exception as error:  # noqa: BLE001 - foreign experiments may raise anything, and it is to be reported
        say({"failed": name, "reason": f"{type(error).__name__}: {error}".splitlines()[0]})
    else:
        remember(name, loading)
        say({"ready": name})


def main() -> None:
    """Warm experiment after experiment until there are no more."""
    leave_interrupts_to_parent()
    follow_parent(os.getppid())
    say = output()
    if "--at-once" not in sys.argv:
        os.nice(LOW_PRIORITY)
    dict(EXPERIMENTS)
    say({"total": len(FUNCTIONS)})
    with watched(lambda _: None, lambda name, seconds: say({"function": name, "seconds": round(seconds, 3)})):
        for line in sys.stdin:
            warm(line.strip(), say)


if __name__ == "__main__":
    main()
