"""Learning the dynamics while tracking: the studies of Bando 2007, ch. 3 section 4.

Bando's videos are not available; both studies are on a simulated surrogate of them (docs/methods/switching.md): a
ball of radius 8 px, seen well, and seen among look-alikes behind a pillar.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Value
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import find
from pftrack.experiments.ball.scene import BallSource
from pftrack.filters.learning import online_em
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, recipe
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run

REFERENCES = References(__file__)
CYCLE_FRAMES = 30
CYCLES = 10

CLUTTER_FRAMES, CLUTTER_SEEDS = 423, 50
CLUTTER_LOST = 100
SPLIT = 8
"""Pieces into which the seeds of a tracker are split."""


@dataclass(frozen=True)
class Course:
    """One run of the free ball: sigma, period and observation-sampled frames by cycle, and the final model."""

    sigma: Floats
    period: Floats
    observed: Floats
    newer: float
    older: float


def unobstructed(pool: Pool, full: bool) -> Findings:
    """Spread and learned period of a ball in plain sight, cycle by cycle."""
    frames = CYCLES * 2 * CYCLE_FRAMES
    values = {**_ball(), **_learning("slow learning, strong guard"), "amplitude_px": 80}
    slow, hard = (
        pool.runs(
            _course, [recipe("ball", tracker, values, seed=seed, frames=frames) for seed in range(40 if full else 8)]
        )
        for tracker in ("condensation", "h-spf")
    )
    sigma = np.mean([course.sigma for course in slow], axis=0)
    periods = {"Condensation": slow, "h-SPF": hard}
    coefficients = {"A1": [course.newer for course in hard], "A0": [course.older for course in hard]}
    observed = np.mean([course.observed for course in hard], axis=0)
    later = float(observed[2:].mean())
    yield from REFERENCES.judge_all("sigma", {it + 1: sigma[it] for it in (range(CYCLES) if full else (0, 1, 4, 9))})
    yield REFERENCES.judge("late-sigma", np.mean([course.sigma[2:] for course in hard]))
    yield from REFERENCES.judge_all(
        "period", {it: np.median([one.period[-1] for one in periods[it]]) for it in periods}
    )
    yield from REFERENCES.judge_all("coefficient", {name: np.median(found) for name, found in coefficients.items()})
    yield REFERENCES.judge("stops", later, holds=observed[0] > later and later < 0.5)
    yield REFERENCES.judge("rises", observed[1] - observed[0])


SCENES: dict[str, tuple[float, tuple[tuple[float, float, float], ...], int]] = {
    "S1": (40, ((110, 50, 8), (215, 190, 8), (280, 60, 6)), 0),
    "S2": (50, ((110, 60, 8), (215, 180, 8), (255, 70, 6)), 0),
    "many": (40, (), 30),
}
"""Occluder width, u, v and radius of the look-alikes, px, and how many more things have their colour."""

MANY_SEEDS = 24

WEAK = "S2, fast learning, weak guard"
HANDED_DOWN = "upf recursive"


@dataclass(frozen=True)
class ClutterTrials:
    """Runs of one tracker among look-alikes."""

    scene: str
    tracker: str
    seeds: tuple[int, ...]
    learning: str


def clutter(pool: Pool, full: bool) -> Findings:
    """Success among look-alikes behind a pillar, with and without learning."""
    del full
    for name, stated in REFERENCES.table("success").items():
        scene, _, learning = name.partition(", ")
        success = {it: _success(pool, scene, it, learning, CLUTTER_SEEDS) for it in (*stated, HANDED_DOWN)}
        for tracker, ours in success.items():
            known = "handed-down" if tracker == HANDED_DOWN else "success"
            yield REFERENCES.judge(known, ours, name, tracker)
        if name in {"S1, no learning", WEAK}:
            switching, others = ("h-spf", "s-spf"), ("condensation", "apf corrected")
            margin = min(success[it] for it in switching) - max(success[it] for it in others)
            yield REFERENCES.judge("margin", margin, name)
        if name == WEAK:
            yield REFERENCES.judge("collapse", success["apf"], name)
            yield REFERENCES.judge("stays-good", success["upf"], name, "")
            yield REFERENCES.judge("stays-good", success[HANDED_DOWN], name, ", its covariance handed down,")
    yield from _among_many(pool)


def _success(pool: Pool, scene: str, tracker: str, learning: str, seeds: int) -> float:
    """Return the share of seeds with which a tracker holds the ball."""
    parts = [ClutterTrials(scene, tracker, tuple(range(first, seeds, SPLIT)), learning) for first in range(SPLIT)]
    return sum(pool.map(_survivors, parts)) / seeds


def _among_many(pool: Pool) -> Findings:
    """Look for the collapse of the sharpened APF among many things of the ball's colour, as in fig. 3.14."""
    before = _success(pool, "many", "apf", "no learning", MANY_SEEDS)
    fast = "fast learning, weak guard"
    after, hard, unscented = (_success(pool, "many", it, fast, MANY_SEEDS) for it in ("apf", "h-spf", HANDED_DOWN))
    yield REFERENCES.judge("many-until", before - after, holds=before > 0.7 and after < 0.3)
    yield REFERENCES.judge("many-switching", hard - after)
    yield REFERENCES.judge("many-unscented", unscented)


def _survivors(trials: ClutterTrials) -> int:
    width, look_alikes, clutter_count = SCENES[trials.scene]
    experiment = find("ball")
    setup = replace(experiment.simulate(), open_source=partial(BallSource, look_alikes=look_alikes))
    tracker, _, variant = trials.tracker.partition(" ")
    values: dict[str, Value] = {
        **_ball(),
        **_learning(trials.learning),
        "amplitude_px": 70,
        "occlusion_width_px": width,
        "clutter_count": clutter_count,
        "apf_weights": variant if tracker == "apf" and variant else "sharpened",
        "recursive_covariance": variant == "recursive",
    }
    rows = outcomes(experiment, setup, values=values, trackers=[tracker], seeds=trials.seeds, frames=CLUTTER_FRAMES)
    return sum((outcome.lost_frames or 0) <= CLUTTER_LOST for (outcome,) in rows)


def _ball() -> Mapping[str, Value]:
    return REFERENCES.settings["scenes"]["ball"]


def _learning(name: str) -> Mapping[str, Value]:
    return REFERENCES.settings["learning"][name]


def _observes(row: Diagnostics) -> bool:
    """Whether any particle came from the observation."""
    samples = row.vector("samples")
    return samples is not None and samples[1] > 0


def _course(run: Run) -> Course:
    periods = [
        online_em.period_frames(online_em.dynamics(step.state.learner, np.zeros((2, 2))))
        for step in run
        if step.diagnostics.frame % CYCLE_FRAMES == CYCLE_FRAMES - 1 and step.state.learner is not None
    ]
    learner = run.current.state.learner
    if learner is None:
        raise RuntimeError("the study is one of learning, but nothing was learned")
    rows = run.diagnostics[1:]
    cycles = [rows[start : start + CYCLE_FRAMES] for start in range(0, CYCLES * CYCLE_FRAMES, CYCLE_FRAMES)]
    return Course(
        np.array([np.mean([max(row.sigma) for row in cycle]) for cycle in cycles]),
        np.array(periods),
        np.array([sum(map(_observes, cycle)) for cycle in cycles], dtype=np.float64),
        float(learner.theta[0, 0]),
        float(learner.theta[0, 2]),
    )
