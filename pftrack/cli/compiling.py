"""Saying that a command compiles, which it does once on a machine and which takes longer than all else."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from pftrack.cli.output import note

__all__ = ["compiling"]

EVERY_S = 3.0


@contextmanager
def compiling() -> Iterator[None]:
    """Say on standard error that functions are compiled and how many; nothing if none is."""
    from pftrack.core.numerics.compiled import FUNCTIONS
    from pftrack.doctor.warming.watch import watch

    begin = time.monotonic()
    done: list[str] = []
    said = 0.0

    def on_begin(name: str) -> None:
        nonlocal said
        del name
        if not said:
            said = time.monotonic()
            note("pftrack: compiling what this needs, only once; `pftrack doctor --warm` compiles everything")

    def on_end(name: str, seconds: float) -> None:
        nonlocal said
        del seconds
        done.append(name)
        if time.monotonic() - said > EVERY_S:
            said = time.monotonic()
            note(f"pftrack: compiling, {len(done)} functions of at most {len(FUNCTIONS)}")

    with watch(on_begin, on_end):
        yield
    if done:
        note(f"pftrack: {len(done)} functions compiled in {time.monotonic() - begin:.0f} s")
