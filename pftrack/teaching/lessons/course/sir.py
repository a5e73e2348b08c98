"""Lesson 9: predict, weigh and redraw, which is the particle filter, on a robot in a corridor with doors.

The robot walks 3 m in a step, give or take some noise, and senses only whether it is next to a door. It knows the
doors' places but not its own. Its position is one number, so the exact density fits on a grid of narrow cells, and a
cloud of particles can be compared with it. Lesson 10 sends its particles through the same corridor.
"""

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Generator, Purpose, Stream
from pftrack.filters import bootstrap
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import Resampler, systematic
from pftrack.teaching.lessons.course.recursion import GRID, MEASURED, PRIOR_VARIANCE, RecursionParameters, moments
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOOK = look(__file__)
LENGTH_M = 100.0
ACROSS_M = 0.0, LENGTH_M
DOORS_M = (12.0, 30.0, 41.0, 73.0, 88.0)
DOORS: dict[str, Any] = {f"door {number}": (place,) for number, place in enumerate(DOORS_M)}
"""As in the panels."""
DOOR_SPREAD_M = 1.5
"""Standard deviation of the distance from a door's middle at which the sensor notices it."""
PACE_M = 3.0
START_M = 9.0
STEPS = 12
TYPICAL = 20
"""Seed of a walk past three doors, after which the robot may still be at one of two places."""

CELL_M = 0.1
CELLS_M: Floats = np.asarray(CELL_M * (np.arange(round(LENGTH_M / CELL_M)) + 0.5))
"""Middles of the grid's cells."""
BIN_M = 2.0
BINS_M: Floats = np.asarray(BIN_M * np.arange(round(LENGTH_M / BIN_M) + 1))
"""Edges of the bins in which a cloud and a density are compared."""


@dataclass(frozen=True, slots=True)
class Pace:
    """Dynamics of one number, which grows by N(mean, sd^2) in a step.

    Attributes:
        mean: Mean of the added density.
        sd: Its standard deviation.
    """

    mean: float
    sd: float

    def predict(self, states: Floats) -> Floats:
        """Return the means (N, 1) of the next states, given states (N, 1)."""
        return states + self.mean

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, 1) around the means (N, 1) of the ancestors (n,) chosen."""
        drawn: Floats = means[ancestors] + self.sd * rng.standard_normal((len(ancestors), 1))
        return drawn


@dataclass(frozen=True, slots=True)
class Walk:
    """The robot's true path and measurements.

    Attributes:
        positions_m: (STEPS + 1,) where it truly is, at the start and after each step.
        doors: (STEPS,) whether it sensed a door after each step.
    """

    positions_m: Floats
    doors: Bools


@dataclass(frozen=True, slots=True)
class Exact:
    """The exact densities on the cells, 1/m.

    Attributes:
        predicted: (STEPS, cells) after each step, before its measurement.
        given: (STEPS + 1, cells) at the start, when it may be anywhere, and after each measurement.
    """

    predicted: Floats
    given: Floats


@dataclass(frozen=True, slots=True)
class Corridor:
    """The model that robot, filter and grid share.

    Attributes:
        noise_m: Standard deviation of a step's length.
        quality: How well the sensor distinguishes a door from a wall, from 0, not at all, to 1.
    """

    noise_m: float = 0.6
    quality: float = 0.9

    def likelihood(self, positions_m: Floats, door: bool) -> Floats:
        """Return the probability, at each position (n,), of sensing a door or none; 0 outside the corridor."""
        apart = np.abs(positions_m - np.array(DOORS_M)[:, None]).min(axis=0) / DOOR_SPREAD_M
        seen = (1.0 - self.quality) / 2.0 + self.quality * np.exp(-0.5 * apart * apart)
        within = (positions_m >= 0.0) & (positions_m <= LENGTH_M)
        return np.where(within, seen if door else 1.0 - seen, 0.0)

    def walk(self, seed: int) -> Walk:
        """Let the robot walk from its start, and sense."""
        numbers = Stream(seed, 0, Purpose.SCENE)
        positions = START_M + np.cumsum(PACE_M + self.noise_m * numbers.standard_normal(STEPS))
        doors = numbers.random(STEPS) < self.likelihood(positions, door=True)
        return Walk(np.concatenate([[START_M], positions]), doors)

    def exact(self, doors: Bools) -> Exact:
        """Return the densities given what was sensed after each step, (STEPS,)."""
        reach = math.ceil((PACE_M + 5.0 * self.noise_m) / CELL_M)
        moves = CELL_M * np.arange(-reach, reach + 1)
        kernel = np.exp(-0.5 * np.square((moves - PACE_M) / self.noise_m))
        predicted, given = np.empty((STEPS, len(CELLS_M))), np.empty((STEPS + 1, len(CELLS_M)))
        given[0] = 1.0 / LENGTH_M
        for step, door in enumerate(doors):
            # Positions outside the corridor are impossible, and the rest is rescaled.
            moved = np.convolve(given[step], kernel)[reach:-reach]
            weighed = moved * self.likelihood(CELLS_M, bool(door))
            predicted[step] = moved / (moved.sum() * CELL_M)
            given[step + 1] = weighed / (weighed.sum() * CELL_M)
        return Exact(predicted, given)

    def clouds(
        self,
        doors: Bools,
        count: int,
        seed: int,
        *,
        resample: Resampler = systematic,
        threshold: float = 1.0,
    ) -> list[ParticleSet]:
        """Return the particles at the start and after each step, weighted by what was sensed then.

        Args:
            doors: (n,) whether a door was sensed after each step.
            count: Number of particles.
            seed: Seed of the filter's random numbers.
            resample: The resampler.
            threshold: They are drawn only if the effective sample size is below this share of the particles.
        """
        places = LENGTH_M * Stream(seed, 0, Purpose.START).random((count, 1))
        clouds = [ParticleSet.uniform(places)]
        for step, door in enumerate(doors, start=1):
            posterior = bootstrap.step(
                clouds[-1],
                Pace(PACE_M, self.noise_m),
                partial(self._log_likelihood, bool(door)),
                Stream(seed, step, Purpose.TRACK),
                resample=resample,
                threshold=threshold,
            )
            clouds.append(posterior.particles)
        return clouds

    def _log_likelihood(self, door: bool, states: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            return np.log(self.likelihood(states[:, 0], door))


@lru_cache(maxsize=32)
def cached_walk(corridor: Corridor, seed: int = TYPICAL) -> tuple[Walk, Exact]:
    """Return a walk, and what can be known of it at best."""
    walk = corridor.walk(seed)
    exact = corridor.exact(walk.doors)
    for array in (walk.positions_m, walk.doors, exact.predicted, exact.given):
        array.flags.writeable = False
    return walk, exact


def assign_bins(positions_m: Floats, weights: Floats) -> Floats:
    """Return the share of the weights (n,) in each bin, relative to all weights in the corridor."""
    return np.histogram(positions_m, BINS_M, weights=weights)[0]


def total_variation(cloud: ParticleSet, density: Floats) -> float:
    """Return half the sum of the differences between the bins' shares of a cloud and of a density (cells,), 1/m."""
    ours, exact = assign_bins(cloud.states[:, 0], cloud.weights), assign_bins(CELLS_M, density * CELL_M)
    return float(0.5 * np.abs(ours - exact).sum())


MOST_STEMS, MOST_DOTS = 400, 50
"""Particles that are drawn of a step, spread evenly over all of them."""
COARSE = 4
"""Cells to a point of a curve."""
PER_COLUMN = 10
"""Cells to a column of the map."""


class SirParameters(Parameters):
    """The filter, the robot and its sensor."""

    particles: int = parameter(100, "Particles N", within=(10, 6400, 10))
    """Number of positions that the filter tracks at once."""
    noise_m: float = parameter(0.6, "Motion noise", unit="m", within=(0.1, 3, 0.1))
    """Standard deviation of the length of a step, which is 3 m on average."""
    quality: float = parameter(0.9, "Sensor quality", within=(0, 1, 0.05))
    """Reliability of the sensor: 0 is guessing, 1 is never wrong."""
    step: int = parameter(STEPS, "Step", within=(0, STEPS, 1))
    """The step to show."""


def steps_so_far(redrawn: list[Floats], walk: Walk, exact: Exact, parameters: SirParameters) -> Panel:
    """Return the map of all steps: what can be known, and up to one of them where particles and robot are."""
    step, steps = parameters.step, np.arange(STEPS + 1.0)
    columns = exact.given.reshape(STEPS + 1, -1, PER_COLUMN).mean(axis=2)
    every = max(len(redrawn[0]) // MOST_DOTS, 1)
    dots = np.array([places[::every] for places in redrawn])
    return LOOK.draw(
        "steps",
        {
            # The root, since at first it is spread over all of the corridor and at last over a few metres.
            "known": (CELLS_M.reshape(-1, PER_COLUMN).mean(axis=1), steps, np.sqrt(columns)),
            **DOORS,
            "particles": (dots.ravel(), np.repeat(steps[: step + 1], dots.shape[1])),
            "robot": (walk.positions_m[: step + 1], steps[: step + 1]),
        },
        turned=parameters,
        x=ACROSS_M,
        y=(-0.5, STEPS + 0.5),
        step=step,
        robot=walk.positions_m[step],
        peak=CELLS_M[np.argmax(exact.given[step])],
    )


def weigh(cloud: ParticleSet, walk: Walk, exact: Exact, corridor: Corridor, step: int) -> Panel:
    """Return the particles of a step with their weights, and the likelihood that gives them."""
    count = len(cloud)
    every = max(count // MOST_STEMS, 1)
    heights = count * cloud.weights
    weight, sensed = np.ones(len(CELLS_M)), "nothing yet"
    if step:
        door = bool(walk.doors[step - 1])
        likelihood = corridor.likelihood(CELLS_M, door)
        weight = likelihood / (exact.predicted[step - 1] @ likelihood * CELL_M)
        sensed = "a door" if door else "no door"
    return LOOK.draw(
        "weighed",
        {
            "likelihood": (CELLS_M[::COARSE], weight[::COARSE]),
            **DOORS,
            "particles": (cloud.states[::every, 0], heights[::every]),
        },
        x=ACROSS_M,
        y=(0.0, ceiling(max(float(heights.max()), float(weight.max())))),
        step=step,
        sensed=sensed,
        count=count,
        size=cloud.effective_sample_size,
    )


def resampled_panel(places: Floats, walk: Walk, exact: Exact, step: int) -> Panel:
    """Return the particles of a step after they were redrawn, and the exact density."""
    density = exact.given[step]
    heights = assign_bins(places, np.full(len(places), 1.0 / len(places))) / BIN_M
    return LOOK.draw(
        "redrawn",
        {
            "exact": (CELLS_M[::COARSE], density[::COARSE]),
            **DOORS,
            "particles": (BINS_M, heights),
            "robot": (float(walk.positions_m[step]),),
        },
        x=ACROSS_M,
        y=(0.0, ceiling(max(float(density.max()), float(heights.max())))),
        step=step,
        most=BINS_M[np.argmax(heights)] + 0.5 * BIN_M,
        peak=CELLS_M[np.argmax(density)],
    )


REPEATS = 40
ANSWER_REPEATS = 200
"""Repetitions of the two averages whose ratio is shown: over 40 it is 2.28, by chance alone."""
CHANCE = 3.0
"""Tolerance of a cloud relative to independent draws, see `tolerate`."""


def show(parameters: SirParameters, seed: int) -> Shown:
    """Run the filter and the exact density up to a step."""
    corridor = Corridor(parameters.noise_m, parameters.quality)
    walk, exact = cached_walk(corridor)
    step, count = parameters.step, parameters.particles
    clouds = corridor.clouds(walk.doors[:step], count, seed)
    density = exact.given[step]
    numbers = {"variation": (total_variation(clouds[-1], density), 0.0, tolerate(density, count))}
    drawn = [
        places.states[systematic(Stream(seed, after + 1, Purpose.TRACK), places.log_weights, count), 0]
        for after, places in enumerate(clouds)
    ]
    panels = (
        steps_so_far(drawn, walk, exact, parameters),
        weigh(clouds[-1], walk, exact, corridor, step),
        resampled_panel(drawn[-1], walk, exact, step),
    )
    return LOOK.show(panels, numbers)


def tolerate(density: Floats, count: int) -> float:
    """Return the tolerance of a working filter's cloud about a density, as a total variation.

    The share of N independent draws in a bin of probability p is nearly normal around p, and on average off by about
    sqrt(2 p (1 - p) / (pi N)); half the sum of that over the bins is their total variation. A filter's cloud is further
    off, since the chance of each redrawing is added to that of all before. The factor was found by repetition: with
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


COMPUTED = Computed(
    _answer,
    {
        "variation-at-100": lambda: _variation(100, 0.11, 0.04),
        "variation-at-6400": lambda: _variation(6400, 0.014, 0.006),
        "slope": _slope,
        "mean": _off,
        "beside-kalman": _beside_kalman,
    },
    Demonstration(SirParameters(), show, random=True),
)
