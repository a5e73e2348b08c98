"""Chapter 2 of Bando 2007: the Kalman filter on a sine, the particle filter on a cosine."""

from dataclasses import dataclass, field

import numpy as np

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.reproduce.finding import FEWER, PROTOCOL, TRIALS, Finding, claim, compare, three_errors
from pftrack.reproduce.pool import Pool
from pftrack.runs.run import Run

SOURCE_KALMAN = "Bando 2007, ch. 2 section 2.2; reference implementation"
SOURCE_PARTICLES = "Bando 2007, ch. 2 section 3.2; reference implementation"

MEDIANS_BY_COUNT = {10: 0.058, 20: 0.038, 30: 0.034, 50: 0.032, 70: 0.031, 100: 0.031}
MEDIANS_BY_DIMENSION = {
    10: (0.058, 0.136, 0.303, 0.431, 0.589),
    100: (0.031, 0.034, 0.045, 0.060, 0.082),
    1000: (0.029, 0.030, 0.031, 0.034, 0.039),
}
MEDIAN_TRIALS, QUICK_TRIALS = 100, 16
QUICK_TRIALS_OF_KALMAN, TRIALS_OF_KALMAN = 40, 1000


@dataclass(frozen=True)
class Trial:
    """One run of the signal."""

    tracker: str
    seed: int
    parameters: dict[str, Value] = field(default_factory=dict)


def kalman_sine(pool: Pool, full: bool) -> list[Finding]:
    """Mean errors of the Kalman filter on a sine, and its posterior spread."""
    count = TRIALS_OF_KALMAN if full else QUICK_TRIALS_OF_KALMAN
    trials = [Trial("kalman", seed, {"waveform": "sine", "initial_sd": 1.0}) for seed in range(count)]
    outcomes = np.array(pool.map(_kalman_errors, trials))
    rows = (
        ("mean error, all frames", 0.0318, 0.001),
        ("mean error after frame 60", 0.0309, 0.001),
        ("mean observation error", 0.0796, 0.0005),
        ("posterior sd at frame 360", 0.03632, 1e-5),
    )
    findings = []
    for (name, reference, stated), column in zip(rows, outcomes.T, strict=True):
        allowed = stated if full else max(stated, three_errors(column, TRIALS_OF_KALMAN))
        ground = PROTOCOL if full else TRIALS
        findings.append(
            compare(f"kalman-sine: {name}", float(column.mean()), reference, allowed, SOURCE_KALMAN, ground=ground)
        )
    return findings


def sample_count(pool: Pool, full: bool) -> list[Finding]:
    """Median error of the particle filter on a cosine over the number of particles."""
    counts = tuple(MEDIANS_BY_COUNT) if full else (10, 20, 50)
    medians = _medians(pool, [{"sample_count": count} for count in counts], full=full)
    findings = [
        compare(
            f"sample-count-signal: median error, N = {count}",
            median,
            MEDIANS_BY_COUNT[count],
            _tolerance(count, full=full) * MEDIANS_BY_COUNT[count],
            SOURCE_PARTICLES,
            ground=PROTOCOL if full else FEWER,
        )
        for count, median in zip(counts, medians, strict=True)
    ]
    falling = dict(zip(counts, medians, strict=True))
    holds = falling[10] >= falling[20] >= falling[50]
    statement = "sample-count-signal: error falls from N = 10 over 20 to 50"
    return [*findings, claim(statement, falling[10] - falling[50], holds=holds, source=SOURCE_PARTICLES)]


def dimension(pool: Pool, full: bool) -> list[Finding]:
    """Median error of the particle filter over the dimension of the state, for three numbers of particles."""
    dimensions = (1, 2, 3, 4, 5) if full else (1, 5)
    findings = []
    for count, references in MEDIANS_BY_DIMENSION.items():
        settings: list[dict[str, Value]] = [{"sample_count": count, "dimension": copies} for copies in dimensions]
        medians = _medians(pool, settings, full=full)
        for copies, median in zip(dimensions, medians, strict=True):
            reference = references[copies - 1]
            name = f"dimension: median error, N = {count}, dimension {copies}"
            allowed, ground = _tolerance(count, full=full) * reference, PROTOCOL if full else FEWER
            findings.append(compare(name, median, reference, allowed, SOURCE_PARTICLES, ground=ground))
        growth = medians[-1] / medians[0]
        holds = growth > 1.25 and (count == 1000 or bool((np.diff(medians) > 0).all()))
        statement = f"dimension: error grows with dimension, N = {count} (ratio of dimension 5 to 1)"
        findings.append(claim(statement, growth, holds=holds, source=SOURCE_PARTICLES))
    return findings


def _medians(pool: Pool, settings: list[dict[str, Value]], *, full: bool) -> list[float]:
    count = MEDIAN_TRIALS if full else QUICK_TRIALS
    trials = [Trial("condensation", seed, setting) for setting in settings for seed in range(count)]
    errors = np.array(pool.map(_mean_error, trials)).reshape(len(settings), count)
    return [float(median) for median in np.median(errors, axis=1)]


def _tolerance(count: int, *, full: bool) -> float:
    """Relative tolerance of a median: that which the reference states for 100 trials, or wider for fewer."""
    stated = 0.08 if count >= 50 else 0.15 if count > 10 else 0.2
    return stated if full else stated * float(np.sqrt(MEDIAN_TRIALS / QUICK_TRIALS))


def _run(trial: Trial) -> Run:
    experiment = find("sine")
    run = Run(
        experiment,
        experiment.simulate(),
        tracker=trial.tracker,
        seed=trial.seed,
        timeline=(Change(0, trial.parameters),),
    )
    run.finish()
    return run


def _mean_error(trial: Trial) -> float:
    return float(np.mean([row.error for row in _run(trial).diagnostics[1:] if row.error is not None]))


def _kalman_errors(trial: Trial) -> tuple[float, float, float, float]:
    rows = _run(trial).diagnostics[1:]
    errors = np.array([row.error for row in rows], dtype=np.float64)
    observed = [abs(row.observation[0] - row.truth[0]) for row in rows if row.observation and row.truth]
    return float(errors.mean()), float(errors[60:].mean()), float(np.mean(observed)), rows[-1].sigma[0]
