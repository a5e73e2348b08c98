"""Recording a loop: the cost of `pftrack.record` relative to the loop itself.

The loop is a plain bootstrap particle filter in NumPy: states of four numbers are moved by Gaussian noise, weighted by
a measured position, and resampled systematically. All particles, weights and ancestors of every frame are written, in
single precision. The figures are processor times, which other processes disturb least: of the loop alone, of the calls
in the loop's thread, and of the writing thread, which uses another core if one is free. Nothing waits for the disk.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import tempfile  # noqa: E402
from collections.abc import Callable, Iterator  # noqa: E402
from pathlib import Path  # noqa: E402
from statistics import median  # noqa: E402
from time import process_time, thread_time  # noqa: E402

import numpy as np  # noqa: E402

import pftrack  # noqa: E402

GOAL = 0.1
"""Goal, as a share of the loop's own time."""


def loop(count: int, frames: int, record: Callable[..., None]) -> tuple[float, float]:
    """Run the filter; return the processor time of the loop, and of the recorder's calls in it, s."""
    rng = np.random.default_rng(0)
    states = np.zeros((count, 4))
    ancestors = np.arange(count)
    calls, begun = 0.0, thread_time()
    for t in range(frames):
        states[:, :2] += states[:, 2:] + rng.standard_normal((count, 2))
        states[:, 2:] += 0.1 * rng.standard_normal((count, 2))
        measured = np.array([0.5 * t, 10.0 * np.sin(t / 20.0)])
        log_weights = -0.5 * np.square(states[:, :2] - measured).sum(axis=1) / 4.0
        called = thread_time()
        record(t, particles=states, log_weights=log_weights, ancestors=ancestors)
        calls += thread_time() - called
        weights = np.exp(log_weights - log_weights.max())
        reached = np.cumsum(weights) / weights.sum()
        ancestors = np.minimum(np.searchsorted(reached, (rng.random() + np.arange(count)) / count), count - 1)
        states = states[ancestors]
    return thread_time() - begun - calls, calls


def measure(total: int, repeats: int) -> Iterator[dict[str, object]]:
    """Measure loops with few and with many particles per frame, with the same number of particle states in all."""
    for count in (1_000, 10_000, 100_000):
        frames = max(total // count, 1)
        progress(f"{count} particles")
        alone, calls, writer = [], [], []
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(repeats):
                begun, own = process_time(), thread_time()
                with pftrack.record(Path(folder, "loop.pft")) as record:
                    lasted, called = loop(count, frames, record)
                writer.append(process_time() - begun - (thread_time() - own))
                alone.append(lasted)
                calls.append(called)
            size = Path(folder, "loop.pft").stat().st_size
        yield {
            "particles": count,
            "frames": frames,
            "loop s": round(median(alone), 3),
            "calls s": round(median(calls), 3),
            "calls / loop": round(median(calls) / median(alone), 3),
            "goal": GOAL,
            "writer s": round(median(writer), 3),
            "MB": round(size / 1e6),
        }


if __name__ == "__main__":
    said = arguments(
        __doc__.splitlines()[0],
        total=Size(10_000_000, 2_000, "particle states of each loop"),
        repeats=Size(5, 1, "loops of each kind"),
    )
    report("Recording a loop", list(measure(int(said.total), int(said.repeats))), as_json=said.json)
