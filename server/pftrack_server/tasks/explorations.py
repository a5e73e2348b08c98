"""Exploring in a confined process what else a session's run might have been."""

import time
from collections.abc import Callable, Generator, Iterator
from typing import Any, TypeAlias

from pftrack.analysis.counterfactuals.report import Report, record, what_if
from pftrack.analysis.other_seeds import RUNS, Scene, ensembling, other_seeds
from pftrack.core.model.parameters import ParameterError, Parameters, flat, limit_particles
from pftrack.experiments.own.code import trust
from pftrack_server.worker.protocol import WorkerConfig
from pftrack_server.worker.run_tree import RunTree

TELL_S = 0.25
"""Between two reports of how far it has come: to write one takes some milliseconds, and the page asks as often."""

Growing: TypeAlias = Generator[dict[str, Any], None, dict[str, Any]]


def explore_changes(
    config: WorkerConfig,
    computed: int,
    frame: int | None,
    share: tuple[int, int],
    known: Report | None,
    seconds: float,
) -> Growing:
    """Try what would have saved a run, and tell of it as it grows, by records of reports.

    Args:
        config: What makes the run.
        computed: How far it has been computed.
        frame: In the loss that is meant; the first that lasts if None.
        share: (k, n): of n parts of the changes only the k-th is tried.
        known: What was found before.
        seconds: After so long it ends with what it has found.

    Raises:
        LossError: The run has not lost its target.
    """
    run = _run(config)
    run.seek(min(max(computed, run.computed), run.frames - 1))

    def allow(tracker: str, parameters: Parameters) -> bool:
        declared = run.experiment.declarations(type(parameters))
        try:
            limit_particles(declared, flat(parameters), tracker, config.max_particles)
        except ParameterError:
            return False
        return True

    growing = what_if(run, frame, allow=allow, share=share, known=known)
    return (yield from _tell(growing, record, seconds))


def explore_seeds(config: WorkerConfig, frames: int, scene: Scene, seconds: float) -> Growing:
    """Carry out runs of the same settings with other seeds, and tell of them as they go on.

    Args:
        config: What makes the run.
        frames: How far they go.
        scene: What they see.
        seconds: After so long they end where they are.
    """
    run = _run(config)
    seeds = other_seeds(run.seed, RUNS)
    growing = ensembling(run, seeds, min(frames, run.frames), scene=scene)
    return (yield from _tell(growing, lambda found: found.as_dict(), seconds))


def _run(config: WorkerConfig) -> Any:  # noqa: ANN401 - a run, as its tree has it
    trust(*config.filters)
    return RunTree(config).run


def _tell(growing: Iterator[Any], words: Callable[[Any], dict[str, Any]], seconds: float) -> Growing:
    """Go on as long as there is time, and yield now and then what has been found; return the last of it."""
    last = next(growing)
    begun = told = time.monotonic()  # what it needs for the first time has been loaded
    for last in growing:
        now = time.monotonic()
        if now - begun > seconds:
            break
        if now - told > TELL_S:
            yield words(last)
            told = now
    return words(last)
