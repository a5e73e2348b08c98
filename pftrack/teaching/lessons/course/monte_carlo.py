"""Lesson 7: samples represent a density, and their error."""

import math
from functools import partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Panel, Shown, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOOK = look(__file__)
MEAN, SD = 2.0, 1.5
LOW, HIGH = MEAN - 4.0 * SD, MEAN + 4.0 * SD

SIZES = 10, 30, 100, 300, 1000, 3000, 10_000
"""Numbers of samples at which the error is measured; what is drawn for one of them is part of the next."""

REPEATS = 50
"""Number of clouds for the error on the screen."""

CELL = 0.5
"""Width of a grid's cell, m."""


class MonteCarloParameters(Parameters):
    """Numbers of samples and of dimensions."""

    count: int = parameter(1000, "Samples N", within=(10, SIZES[-1], 10))
    """Number of samples in the cloud."""
    dimension: int = parameter(1, "Dimension", within=(1, 10, 1))
    """Number of independent, identical coordinates of a sample."""


def sample(seed: int, count: int, dimension: int, repeats: int) -> tuple[Floats, Floats]:
    """Draw clouds such that a smaller one is the beginning of a larger one.

    Args:
        seed: Seed of all draws.
        count: Samples of a cloud, at most 10,000.
        dimension: Coordinates of a sample.
        repeats: Number of clouds.

    Returns:
        The first coordinate of the first cloud's samples, (count,); and the means of all clouds from their first `n`
        samples, (sizes, repeats, dimension), for every n of `SIZES` below the count and the count itself.
    """
    totals, shown, sums = [], [], np.zeros((repeats, dimension))
    for part, (first, last) in enumerate(zip((0, *SIZES), SIZES, strict=False)):
        if first >= count:
            break
        parts = [
            MEAN + SD * Stream(seed, axis * len(SIZES) + part, Purpose.SCENE).standard_normal((repeats, last - first))
            for axis in range(dimension)
        ]
        kept = np.stack(parts, axis=1)[:, :, : count - first]
        shown.append(kept[0, 0])
        sums = sums + kept.sum(axis=2)
        totals.append(sums / (first + kept.shape[2]))
    return np.concatenate(shown), np.stack(totals)


def sizes_up_to(count: int) -> Floats:
    """Return the sizes below a count, and the count."""
    return np.array([*(size for size in SIZES if size < count), count], dtype=np.float64)


def rms(means: Floats) -> Floats:
    """Return the root mean square error of each coordinate, (sizes,), of means (sizes, repeats, dimension)."""
    errors: Floats = np.sqrt(np.mean((means - MEAN) ** 2, axis=(1, 2)))
    return errors


def show(parameters: MonteCarloParameters, seed: int) -> Shown:
    """Show the samples, their mean as they come in, and the error of clouds of all sizes."""
    count, dimension = parameters.count, parameters.dimension
    samples, means = sample(seed, count, dimension, REPEATS)
    errors, exact = rms(means), SD / math.sqrt(count)
    numbers = {
        "error": (float(errors[-1]), exact, 4.0 * exact / math.sqrt(2.0 * REPEATS * dimension)),
        "mean": (float(means[-1, 0, 0]), MEAN, 4.0 * exact),
        "cells": (((HIGH - LOW) / CELL) ** dimension,),
    }
    heights = Stream(seed, len(SIZES) * 10, Purpose.SCENE).random(SIZES[-1])[:count]
    panels = (
        _cloud_panel(samples, heights),
        _mean_panel(samples),
        _error_panel(sizes_up_to(count), errors, dimension),
    )
    return LOOK.show(panels, numbers, axis=" an axis," if dimension > 1 else "", clouds=REPEATS, cell=CELL)


def _cloud_panel(samples: Floats, heights: Floats) -> Panel:
    places, x = np.linspace(LOW, HIGH, 161), samples[:2000]
    return LOOK.draw(
        "cloud",
        {
            "density": (places, normal(places, MEAN, SD)),
            "samples": (x, heights[:2000] * normal(x, MEAN, SD)),
            "mean": (float(samples.mean()),),
        },
        x=(LOW, HIGH),
        count=len(samples),
        mean=MEAN,
        sd=SD,
    )


def _mean_panel(samples: Floats) -> Panel:
    some = np.unique(np.geomspace(1, len(samples), 200).astype(np.int64))
    running = (np.cumsum(samples) / np.arange(1, len(samples) + 1))[some - 1]
    reach = 2.0 * SD / np.sqrt(some)
    return LOOK.draw(
        "mean",
        {"exact": (MEAN,), "above": (some, MEAN + reach), "below": (some, MEAN - reach), "running": (some, running)},
        x=(1.0, float(SIZES[-1])),
        y=(MEAN - 2.0, MEAN + 2.0),
        mean=MEAN,
        count=len(samples),
        last=running[-1],
    )


def _error_panel(sizes: Floats, errors: Floats, dimension: int) -> Panel:
    ends = np.array([SIZES[0], SIZES[-1]], dtype=np.float64)
    gaps = (HIGH - LOW) / ends ** (1.0 / dimension)
    return LOOK.draw(
        "error",
        {"exact": (ends, SD / np.sqrt(ends)), "rms": (sizes, errors), "gap": (ends, gaps)},
        x=(float(SIZES[0]), float(SIZES[-1])),
        repeats=REPEATS,
        dimension=dimension,
        most=SIZES[-1],
        plural="s" if dimension > 1 else "",
        gap=gaps[-1],
    )


def _answer(parameters: MonteCarloParameters, seed: int) -> Answer:
    measured = float(rms(sample(seed, SIZES[-1], parameters.dimension, REPEATS)[1])[-1])
    words = f"Over {REPEATS} clouds of 10,000 samples, the error is {measured:.4f} m."
    return Answer(100.0 * parameters.count, words=words)


def _slope() -> Outcome:
    errors = rms(sample(1, SIZES[-1], 1, 400)[1])
    return Outcome(float(np.polyfit(np.log(SIZES), np.log(errors), 1)[0]), -0.5, 0.03)


def _error(dimension: int, tolerance: float) -> Outcome:
    errors = rms(sample(1, 1000, dimension, 400)[1])
    return Outcome(float(errors[-1]), SD / math.sqrt(1000.0), tolerance)


COMPUTED = Computed(
    _answer,
    {
        "slope": _slope,
        "error": partial(_error, 1, 0.006),
        "six-dimensions": partial(_error, 6, 0.004),
    },
    Demonstration(MonteCarloParameters(), show, random=True),
)
