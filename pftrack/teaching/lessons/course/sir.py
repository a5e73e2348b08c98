"""Lesson 9: predict, weigh and redraw, which is the particle filter, on a robot in a corridor with doors."""

import math
from functools import lru_cache, partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import bootstrap
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import systematic
from pftrack.teaching.lessons.course.corridor import (
    CELL_M,
    CELLS_M,
    STEPS,
    Corridor,
    Pace,
    assign_bins,
    cached_walk,
    resampled_panel,
    steps_so_far,
    total_variation,
    weigh,
)
from pftrack.teaching.lessons.course.rounds import GRID, MEASURED, PRIOR_VARIANCE, RecursionParameters, moments
from pftrack.teaching.lessons.figure import Figure
from pftrack.teaching.lessons.lesson import (
    Answer,
    Check,
    Demonstration,
    Lesson,
    Mistake,
    Number,
    Outcome,
    Question,
    Scenario,
    Shown,
)

ASKED = 400
"""Particles of which the question asks what four times as many bring."""
REPEATS = 40
ANSWER_REPEATS = 200
"""Of the two averages whose ratio is told: over 40 it is 2.28, by chance alone."""
CHANCE = 3.0
"""How much further off than independent draws a cloud may be, see `tolerate`."""


class SirParameters(Parameters):
    """The filter, the robot and its sensor."""

    # fmt: off
    particles: int = parameter(
        100, "Particles N", "How many positions the filter follows at once.", within=(10, 6400, 10))
    noise_m: float = parameter(
        0.6, "Motion noise", "Standard deviation of the length of a step, which is 3 m on average.",
        unit="m", within=(0.1, 3, 0.1))
    quality: float = parameter(
        0.9, "Sensor quality", "How well the sensor tells a door from a wall: 0 is guessing, 1 is never wrong.",
        within=(0, 1, 0.05))
    step: int = parameter(STEPS, "Step", "After which step the robot is looked at.", within=(0, STEPS, 1))
    # fmt: on


def show(parameters: SirParameters, seed: int) -> Shown:
    """Run the filter up to a step, beside the exact density."""
    corridor = Corridor(parameters.noise_m, parameters.quality)
    walk, exact = cached_walk(corridor)
    step, count = parameters.step, parameters.particles
    clouds = corridor.clouds(walk.doors[:step], count, seed)
    density = exact.given[step]
    variation = total_variation(clouds[-1], density)
    allowed = tolerate(density, count)
    numbers = (Number("Share of the cloud in wrong places (total variation)", variation, 0.0, allowed, digits=3),)
    drawn = [
        places.states[systematic(Stream(seed, after + 1, Purpose.TRACK), places.log_weights, count), 0]
        for after, places in enumerate(clouds)
    ]
    return Shown(
        Figure(
            panels=(
                steps_so_far(drawn, walk, exact, step),
                weigh(clouds[-1], walk, exact, corridor, step),
                resampled_panel(drawn[-1], walk, exact, step),
            )
        ),
        numbers,
    )


def tolerate(density: Floats, count: int) -> float:
    """Return how far the cloud of a filter that works may be from a density, as a total variation.

    The share of N independent draws in a bin of probability p is nearly normal around p, and on average off by about
    sqrt(2 p (1 - p) / (pi N)); half the sum of that over the bins is their total variation. A filter's cloud is further
    off, since the chance of each redrawing is added to that of all before. How much further was found by repeats: with
    this lesson's noise and sensor and at least 100 particles, 98 of 100 clouds are within `CHANCE` times that, and
    after no step fewer than 94. One that has settled at a wrong door is beyond it, and so are those whose particles are
    nearly all copies of few, as with little motion noise.

    Args:
        density: On the cells (cells,), 1/m.
        count: Number of particles N.
    """
    shares = assign_bins(CELLS_M, density * CELL_M)
    drawn = 0.5 * np.sqrt(2.0 * shares * (1.0 - shares) / (math.pi * count)).sum()
    return float(CHANCE * drawn)


@lru_cache(maxsize=8)
def _errors(corridor: Corridor, count: int, repeats: int = REPEATS) -> tuple[float, float]:
    """Return the mean total variation after the last step, and the rms error of the mean, m, over the repeats."""
    walk, exact = cached_walk(corridor)
    density = exact.given[-1]
    mean = float(density @ CELLS_M * CELL_M)
    clouds = [corridor.clouds(walk.doors, count, seed)[-1] for seed in range(repeats)]
    off = [float(cloud.weights @ cloud.states[:, 0]) - mean for cloud in clouds]
    return float(np.mean([total_variation(cloud, density) for cloud in clouds])), float(
        np.sqrt(np.mean(np.square(off)))
    )


def _answer(parameters: SirParameters, seed: int) -> Answer:
    del seed
    corridor = Corridor(parameters.noise_m, parameters.quality)
    counts = parameters.particles, 4 * parameters.particles
    few, many = (_errors(corridor, count, ANSWER_REPEATS)[0] for count in counts)
    words = (
        f"Measured over {ANSWER_REPEATS} repeats, the total variation is {few:.4f} with {counts[0]} particles and "
        f"{many:.4f} with {counts[1]}, a factor of {few / many:.3g}."
    )
    return Answer(2.0, few / many, words)


def _variation(count: int, exact: float, tolerance: float) -> Outcome:
    return Outcome(_errors(Corridor(), count)[0], exact, tolerance)


def _slope() -> Outcome:
    counts = 100, 400, 1600, 6400
    errors = [_errors(Corridor(), count)[0] for count in counts]
    return Outcome(float(np.polyfit(np.log(counts), np.log(errors), 1)[0]), -0.5, 0.1)


def _off() -> Outcome:
    return Outcome(_errors(Corridor(), 6400)[1], 0.0, 1.0)


def _fit(measured: float, noise: float, states: Floats) -> Floats:
    return np.asarray(-0.5 * np.square(states[:, 0] - measured) / noise)


def _beside_kalman() -> Outcome:
    """Compare means with those of the Kalman filter, after each measurement of lesson 5."""
    problem, count = RecursionParameters(rounds=len(MEASURED)), 4000
    known_at_best = [moment.exact for moment in moments(GRID, problem) if moment.step == "m"]
    pace = Pace(0.0, math.sqrt(problem.motion))
    places = math.sqrt(PRIOR_VARIANCE) * Stream(1, 0, Purpose.START).standard_normal((count, 1))
    cloud, off = ParticleSet.uniform(places), []
    for step, (measured, exact) in enumerate(zip(MEASURED, known_at_best, strict=True), start=1):
        fit = partial(_fit, measured, problem.noise)
        cloud = bootstrap.step(cloud, pace, fit, Stream(1, step, Purpose.TRACK)).particles
        off.append(cloud.weights @ cloud.states[:, 0] - exact.mean[0])
    variance = float(known_at_best[-1].covariance[0, 0])
    return Outcome(float(np.sqrt(np.mean(np.square(off)))), math.sqrt(variance / count), 0.012)


LESSON = Lesson(
    id="sir",
    number=9,
    title="The particle filter",
    idea=(
        "A robot in a corridor senses only whether a door is beside it. Follow many guesses at once, the particles. "
        "In each step:\n\n"
        "1. *Predict*: move every particle, each with noise of its own.\n"
        "2. *Weigh* it by how well it explains what was sensed, $w_n \\propto p(z \\mid x_n)$.\n"
        "3. *Redraw* in proportion to the weights: good ones are copied, bad ones die.\n\n"
        "The likelihood is the right weight since the predicted cloud is what was drawn from:\n\n"
        "$$p(x \\mid z) \\propto p(z \\mid x)\\, p(x).$$\n\n"
        "Any motion will do, any likelihood, and any number of peaks."
    ),
    body=Demonstration(SirParameters(), show, random=True),
    notice="One door could be any of five; it takes the distances between doors to tell where the robot is.",
    tries=(
        "Step through from 0: at the first door the cloud splits over all five.",
        "Set N to 50 and draw several times: now and then all particles settle at a wrong door.",
        "Set the sensor quality to 0: nothing is learned, and the cloud only spreads and moves on.",
    ),
    question=Question(
        text="With 1,600 particles in place of 400, by what factor does the error of the cloud fall?",
        kind="number",
        answer=_answer,
        at={"particles": ASKED},
        tolerance=0.25,
        bounds=(0.0, 1000.0),
        words="The error goes with one over the root of N, as that of any average: four times as many, half of it.",
        mistakes=(
            Mistake(
                (3.5, 4.5),
                "Were it one over N, it would be 4. But chance adds up by squares: what shrinks to a quarter is the "
                "square of the error.",
            ),
            Mistake(16.0, "It is the other way round: to have a sixteenth of the error takes 256 times the particles."),
            Mistake((1.3, 1.5), "That is the root of 2, for twice as many. Here there are four times as many."),
            Mistake(1.0, "More particles do help: each is a draw, and chance averages out over draws."),
            Mistake((0.2, 0.6), "That is what is left of the error. Asked is the factor by which it falls."),
        ),
    ),
    checks=(
        Check(
            "variation-at-100",
            "With 100 particles the total variation between cloud and grid is about 0.11, on average over 40 repeats.",
            lambda: _variation(100, 0.11, 0.04),
        ),
        Check(
            "variation-at-6400",
            "With 6,400 particles it is about 0.014.",
            lambda: _variation(6400, 0.014, 0.006),
        ),
        Check("slope", "On logarithmic axes it falls over N with a slope of -1/2.", _slope),
        Check("mean", "The mean of 6,400 particles is less than 1 m off that of the grid, rms over 40 repeats.", _off),
        Check(
            "beside-kalman",
            "On lesson 5's problem 4,000 particles are as far from the Kalman filter as root(variance / N).",
            _beside_kalman,
        ),
    ),
    uses=(
        Scenario(
            Recipe(experiment="ball", tracker="condensation", timeline=(Change(0, {"occlusion_width_px": 40}),)),
            unlocked=("seed", "sample_count", "process_noise_px"),
            frame=4,
            plots=("error", "ess"),
            words=(
                "The same three steps on a picture: a cloud of places and velocities, weighed by colour. Watch it "
                "spread in frames 7 and 8, behind the pillar, and close in on the ball again by frame 12."
            ),
        ),
        Scenario(
            Recipe(experiment="ball", tracker="h-spf", timeline=(Change(0, {"sample_count": 40}),)),
            unlocked=("seed", "sample_count"),
            frame=14,
            plots=("error", "ess"),
            words="None of 40 particles meets the ball as it turns in frame 16, as a small cloud misses the robot's "
            "door.",
        ),
    ),
)
