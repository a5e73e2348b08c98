"""The modules that the fork server imports before the first child starts, shared by all children's memory.

Without it each would import everything itself: 0.6-1.8 s and 96 MB in place of 15 ms and 20 MB.
"""

import contextlib
import gc

import cv2
import numba
import numpy as np

import pftrack.runs.record
import pftrack.sources.images
import pftrack.sources.tracks.sequence
import pftrack.sources.video
import pftrack_server.lessons.functions
import pftrack_server.tasks.comparisons
import pftrack_server.tasks.exports
import pftrack_server.tasks.functions
import pftrack_server.worker.worker
from pftrack.experiments import EXPERIMENTS
from pftrack.rendering import png, render
from pftrack.warming import cache_folder, loading_cases, ready, remember
from pftrack.warming.coverage import cases, run_case
from pftrack.warming.watch import loaded_functions

__all__ = ["PRELOADED"]

PRELOADED = (
    cv2,
    numba,
    np,
    pftrack,
    pftrack_server.worker,
)  # imported to be there, and named so that they stay imported

cv2.setNumThreads(1)


def _warm() -> None:
    """Step and draw everything of every experiment for some frames, which loads its compiled code.

    Loading it from the disk takes a worker most of a second; forked with it, none. What is not compiled yet is left
    out, since compiling would keep all sessions waiting: another process does it. An experiment of another package that
    does not run is left as it is: its own sessions say what is wrong, and no other has to wait for it.
    """
    names = frozenset(EXPERIMENTS)
    known = ready(names) if cache_folder() else names
    for name in sorted(known & frozenset(EXPERIMENTS.own)):
        _load(name)
    for name in sorted(known.difference(EXPERIMENTS.own)):
        with contextlib.suppress(Exception):
            for case in cases(EXPERIMENTS[name]):
                drawing = run_case(EXPERIMENTS[name], *case)
            png(render(drawing))


def _load(name: str) -> None:
    """Run the cases that load what an experiment calls and those before it do not, or find out which they are.

    The others call nothing else, and would take as long again.
    """
    remembered = loading_cases(name)
    found: set[int] = set()
    for number, case in enumerate(cases(EXPERIMENTS[name])):
        if number == 0 or remembered is None or number in remembered:
            before = loaded_functions()
            drawing = run_case(EXPERIMENTS[name], *case)
            if loaded_functions() - before:
                found.add(number)
    if remembered is None:
        remember(name, found)
    png(render(drawing))


# What is loaded here stays: to look for garbage on the way takes a tenth of the time.
gc.disable()
_warm()
gc.enable()
