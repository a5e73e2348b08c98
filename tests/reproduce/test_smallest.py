"""Another process computes every result once in its smallest form, so that none breaks unnoticed."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

import pytest

from pftrack.process import UNLIMITED, BlockingPool, ForkServer
from pftrack.reproduce import RESULTS, ball, head, trajectories
from pftrack.reproduce.pool import Pool
from pftrack.sweep import Plan, Result, work
from tests.pooling import fork_server
from tests.reproduce import shortened

__all__ = ["fork_server"]

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


class EnoughError(Exception):
    """A result without a quick form has sent a piece of work to a process and got it back."""


class FirstPieces(Pool):
    """Computes the first piece of each list of work and takes its outcome for all; of sweeps it computes all pieces."""

    once = False

    def map(self, function: Callable[[Item], Outcome], items: Iterable[Item]) -> list[Outcome]:
        """Return as many outcomes as there are items."""
        pieces = list(items)
        if isinstance(function, partial) and function.func is work.compute_chunk:
            return super().map(function, pieces)
        outcomes = super().map(partial(shortened.compute, function), pieces[:1])
        if self.once:
            raise EnoughError
        return outcomes * len(pieces)

    def sweep(self, plan: Plan, out: Path) -> Result:
        """Carry the first sweep out, which is enough."""
        super().sweep(plan, out)
        raise EnoughError


class Kept(BlockingPool):
    """A process that outlives the pools that it computes for: it loads an experiment once."""

    def close(self) -> None:
        """Stay."""


@pytest.fixture(scope="module")
def process(fork_server: ForkServer) -> Iterator[Kept]:
    """What computes the pieces of all results."""
    kept = Kept(fork_server, processes=1, budget=UNLIMITED, prepare=work.one_thread)
    yield kept
    BlockingPool.close(kept)


@pytest.fixture(autouse=True)
def short(process: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of the ball has two frames, the head has few, and the maps have few cells."""
    plans = ball.plans
    monkeypatch.setattr(work, "open_pool", lambda _: process)
    monkeypatch.setattr(ball, "FRAMES", 2)
    monkeypatch.setattr(head.VideoTrials.__init__, "__defaults__", (shortened.HEAD_FRAMES,))
    monkeypatch.setattr(ball, "plans", lambda _full: plans(full=False))
    monkeypatch.setattr(
        trajectories, "TRACKS_METHODS", trajectories.TRACKS_METHODS[::-1]
    )  # one that is run more than once comes first


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_runs_in_another_process(name: str) -> None:
    """Another process computes it, in its full form if it has no quick one."""
    with FirstPieces(2) as pool:
        findings = RESULTS[name].compute(pool, False)
        if [one.verdict for one in findings] == ["not run"]:
            pool.once = True
            with pytest.raises(EnoughError):
                RESULTS[name].compute(pool, True)
    assert findings
