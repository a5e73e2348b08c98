"""Sweeps: time of a run in a batch, parts of a step's time, and the gain by a second worker.

The runs are those of Bando 2007, ch. 3: sixty frames of the ball behind its pillar with 800 particles. The peers are
the same run stepped live, and Condensation as a user would write it: in NumPy, and with `particles`.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402
from tempfile import TemporaryDirectory  # noqa: E402
from time import perf_counter  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402

from pftrack.core.model.parameters import revise  # noqa: E402
from pftrack.core.model.recipe import Change  # noqa: E402
from pftrack.core.model.source import History  # noqa: E402
from pftrack.core.numerics.elementary import exponentials  # noqa: E402
from pftrack.core.numerics.random import standard_normals  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.filters.dynamics import diffuse, predict  # noqa: E402
from pftrack.filters.particles import moments, normalise  # noqa: E402
from pftrack.filters.resampling import parents  # noqa: E402
from pftrack.runs.many import outcomes  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402
from pftrack.sweep import Plan, carry_out  # noqa: E402
from pftrack.sweep.axis import Axis  # noqa: E402
from pftrack.vision.likelihoods.chromaticity import log_kernel  # noqa: E402

Array = np.ndarray[Any, Any]

BALL = find("ball")
COUNT, FRAMES = 800, 60
CONDITION = {"occlusion_width_px": 30.0, "distracter_radius_px": 6.0, "layout": 7, "sample_count": COUNT}
TRANSITION = np.array([[2.0, 0, -1, 0], [0, 2, 0, -1], [1, 0, 0, 0], [0, 1, 0, 0]])
MODEL = (2 / 3, 1 / 6), (200.0, 0.0), 0.1


def best(work: Callable[[], object], repeats: int) -> float:
    """Return the shortest of several times, s; the first call does not count."""
    work()
    times = []
    for _ in range(repeats):
        begun = perf_counter()
        work()
        times.append(perf_counter() - begun)
    return min(times)


def pictures() -> tuple[Array, Array]:
    """Return the pictures (L, height, width, 3) and the ball's first position."""
    setup = BALL.simulate()
    parameters = revise(setup.parameters, CONDITION)
    source = setup.open_source(0, parameters)
    history = History(((0, parameters),))
    return np.stack([source.frame(index, history).image_rgb for index in range(FRAMES)]), source.start.position


def log_likelihood(picture: Array, states: Array) -> Array:
    """Return the log likelihood of states, in plain NumPy."""
    u, v = np.floor(states[:, :2] + 0.5).astype(int).T
    inside = (u >= 0) & (u < picture.shape[1]) & (v >= 0) & (v < picture.shape[0])
    colours = picture[v * inside, u * inside].astype(float)
    redness = colours[:, 0] / colours.sum(axis=1)
    kernel = np.exp(-((redness - 2 / 3) ** 2) / (2 * 0.05**2)) * inside
    return np.log(0.1 + kernel)


def by_hand(shown: Array, start: Array) -> Array:
    """Run Condensation in NumPy."""
    rng = np.random.default_rng(0)
    states = np.tile(start + rng.standard_normal((COUNT, 2)), 2)
    weights = np.full(COUNT, 1 / COUNT)
    estimates = [start]
    for picture in shown[1:]:
        chosen = np.searchsorted(np.cumsum(weights), (np.arange(COUNT) + rng.random()) / COUNT).clip(0, COUNT - 1)
        states = states[chosen] @ TRANSITION.T
        states[:, :2] += 3 * rng.standard_normal((COUNT, 2))
        logs = log_likelihood(picture, states)
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        estimates.append(weights @ states[:, :2])
    return np.array(estimates)


def by_particles(shown: Array, start: Array) -> Array:
    """Run Condensation with `particles`, the model written in NumPy."""
    import particles as library

    rng = np.random.default_rng(0)

    class Ball(library.FeynmanKac):  # type: ignore[misc]
        def M0(self, N):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802, N803 - the library's names
            return np.tile(start + rng.standard_normal((N, 2)), 2)

        def M(self, _t, xp):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            states = xp @ TRANSITION.T
            states[:, :2] += 3 * rng.standard_normal((len(xp), 2))
            return states

        def logG(self, t, _xp, x):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return log_likelihood(shown[t], x)

    filtered = library.SMC(fk=Ball(len(shown)), N=COUNT, resampling="systematic", ESSrmin=1.0, collect="off")
    estimates = []
    for _ in shown:
        next(filtered)
        estimates.append(filtered.W @ filtered.X[:, :2])
    return np.array(estimates)


def live() -> None:
    """Run Condensation as a session does."""
    timeline = (Change(0, CONDITION),)
    Run(BALL, BALL.simulate(), tracker="condensation", frames=FRAMES, timeline=timeline).finish()


def batch(tracker: str, seeds: int) -> Callable[[], object]:
    """Return the work of a condition."""
    setup = BALL.simulate()
    return lambda: outcomes(BALL, setup, values=CONDITION, trackers=[tracker], seeds=range(seeds), frames=FRAMES)


def runs(repeats: int) -> list[dict[str, object]]:
    """Return the rows on the time of a run, by pftrack and by peers."""
    shown, start = pictures()
    seconds = {}
    for tracker in ("condensation", "pc-pf", "apf", "h-spf", "s-spf"):
        progress(f"batch, {tracker}")
        seconds[f"pftrack, batch, {tracker}"] = best(batch(tracker, 10), repeats) / 10
    progress("others")
    seconds["pftrack, live, condensation"] = best(live, repeats)
    seconds["NumPy by hand, condensation"] = best(lambda: by_hand(shown, start), repeats)
    try:
        seconds["particles, model in NumPy, condensation"] = best(lambda: by_particles(shown, start), repeats)
    except ImportError as error:
        progress(f"particles is left out: {error}")
    reference = seconds["pftrack, batch, condensation"]
    steps = COUNT * (FRAMES - 1)
    return [_row(f"a run: {name}", taken, steps / taken, taken / reference) for name, taken in seconds.items()]


def stages(repeats: int) -> list[dict[str, object]]:
    """Return the rows on the parts of a step's time, us."""
    shown, start = pictures()
    picture = shown[0]
    picture.flags.writeable = False
    states = np.asfortranarray(np.tile(start + 8 * np.random.default_rng(0).standard_normal((COUNT, 2)), 2))
    log_weights = normalise(np.zeros(COUNT))[0]
    centres = predict(states, TRANSITION, np.zeros(4))
    ancestors = parents(0, log_weights, COUNT, 0, 1, 1, 0)
    normals = standard_normals(0, 1, 1, 1, 2 * COUNT).reshape(2, COUNT)
    weights = exponentials(log_weights)
    offset, noise = np.zeros(4), 3 * np.eye(4, 2)
    work: dict[str, Callable[[], object]] = {
        "predict": lambda: predict(states, TRANSITION, offset),
        "parents": lambda: parents(0, log_weights, COUNT, 0, 1, 1, 0),
        "normals": lambda: standard_normals(0, 1, 1, 1, 2 * COUNT),
        "diffuse": lambda: diffuse(centres, ancestors, noise, normals),
        "likelihood": lambda: log_kernel(picture, states, *MODEL),
        "normalise": lambda: normalise(log_weights),
        "weights": lambda: exponentials(log_weights),
        "moments": lambda: moments(states, weights),
    }
    microseconds = {
        name: 1e6 * best(lambda it=it: [it() for _ in range(200)], repeats) / 200 for name, it in work.items()
    }  # type: ignore[misc]
    whole = sum(microseconds.values())
    return [_row(f"a step: {name}", taken / 1e6, None, taken / whole) for name, taken in microseconds.items()]


def workers(most: int, trials: int, layouts: int) -> list[dict[str, object]]:
    """Return the rows on a sweep's time with one worker and with more, by default two."""
    plan = Plan(
        "ball",
        (
            Axis("occlusion_width_px", (5.0, 30.0, 55.0, 80.0)),
            Axis("distracter_radius_px", (1.0, 6.0, 11.0, 16.0)),
            Axis("layout", tuple(range(layouts))),
        ),
        ("h-spf", "s-spf", "pc-pf"),
        trials=trials,
        frames=FRAMES,
    )
    seconds = {}
    with TemporaryDirectory() as folder:
        for jobs in range(1, most + 1):
            progress(f"{jobs} workers")
            begun = perf_counter()
            carry_out(plan, Path(folder) / f"{jobs}.parquet", jobs=jobs)
            seconds[jobs] = perf_counter() - begun
    steps = plan.runs * COUNT * (FRAMES - 1)
    return [
        _row(f"{plan.runs} runs: {jobs} workers", taken, steps / taken, taken / seconds[1])
        for jobs, taken in seconds.items()
    ]


def _row(what: str, seconds: float, rate: float | None, ratio: float) -> dict[str, object]:
    return {"what": what, "ms": 1e3 * seconds, "particle-steps/s": rate, "ratio": ratio}


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        repeats=Size(20, 1, "repetitions of each"),
        trials=Size(10, 1, "trials of each condition and tracker of the sweep"),
        workers=Size(2, 1, "most workers of the sweep"),
        layouts=Size(10, 1, "layouts of the look-alikes in the sweep"),
    )
    rows = [*runs(given.repeats), *stages(given.repeats), *workers(given.workers, given.trials, given.layouts)]
    report("A sweep of the ball, 60 frames, 800 particles", rows, as_json=given.json)


if __name__ == "__main__":
    main()
