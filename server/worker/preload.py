"""The modules that a forkserver imports before the first worker starts, shared by all workers' memory.

A preload that cannot be imported is ignored silently by `multiprocessing`, and each worker would then import everything
itself: 0.6-1.8 s and 96 MB in place of 15 ms and 20 MB. So this module remembers which process imported it, and a
worker asserts that it was its parent.
"""

import contextlib
import gc
import os

import cv2
import numba
import numpy as np

import pftrack.runs.record
import pftrack.sources.images
import pftrack.sources.video
import server.tasks.functions
import server.worker.worker
from pftrack.experiment import Experiment
from pftrack.experiments import EXPERIMENTS
from pftrack.rendering import png, render
from pftrack.runs.run import Run

__all__ = ["assert_preloaded"]

PRELOADED = (cv2, numba, np, pftrack, server.worker)  # imported to be there, and named so that they stay imported
PRELOADED_IN = os.getpid()

WARM_FRAMES = 4

cv2.setNumThreads(1)


def assert_preloaded() -> None:
    """Make sure that this process was forked from one that had everything ready.

    Raises:
        RuntimeError: The preload did not take.
    """
    if os.getppid() != PRELOADED_IN:
        raise RuntimeError("the forkserver did not preload: server.worker.preload could not be imported there")


def _warm() -> None:
    """Step and draw every tracker of every experiment for some frames, which loads their compiled code.

    Loading it from the disk takes a worker most of a second; forked with it, none. An experiment of another package
    that does not run is left as it is: its own sessions say what is wrong, and no other has to wait for it.
    """
    for name, experiment in EXPERIMENTS.items():
        with contextlib.nullcontext() if name in EXPERIMENTS.own else contextlib.suppress(Exception):
            _run_trackers(experiment)


def _run_trackers(experiment: Experiment) -> None:
    setup = experiment.simulate()
    for tracker in experiment.trackers:
        run = Run(experiment, setup, tracker=tracker, frames=WARM_FRAMES)
        run.finish()
        png(render(experiment.draw(run.current, run.diagnostics)))


_warm()
# A worker's garbage collector would touch every object that is here, and so copy 37 MB of pages that all of them share.
gc.collect()
gc.freeze()
