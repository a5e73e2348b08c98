"""Trackers of a ball against Bayes' rule on a grid: whatever samples they draw, the posterior and the evidence are one.

With no velocity kept the motion is a random walk in the plane, so that the exact posterior is a convolution and a
product, computed on four points a pixel in either direction. The likelihood is that of the picture itself, with the
ball, a look-alike and a pillar that hides the ball for a while: the posterior has two hills, and once none.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.ball.model import TRACKERS, BallTrackerParameters, colour_model
from pftrack.experiments.shared.reports import PointState
from pftrack.vision.likelihoods import chromaticity

WIDTH, HEIGHT = 64, 48
RED, SPREAD = (200, 50, 50), 2.0
START = np.array([24.0, 22.0])
AT_REST = {"velocity_retention": 0.0, "initial_sd_px": SPREAD, "background_level": 0.1, "process_noise_px": 3.0}
MARGIN, PER_PX = 12, 4
X = np.arange(-MARGIN * PER_PX, (WIDTH + MARGIN) * PER_PX) / PER_PX - 0.5 + 0.5 / PER_PX
Y = np.arange(-MARGIN * PER_PX, (HEIGHT + MARGIN) * PER_PX) / PER_PX - 0.5 + 0.5 / PER_PX

NARROW: dict[str, Value] = {"gamma_min_px": 1.0, "gamma_max_px": 12.0}
VALID: dict[str, tuple[str, dict[str, Value]]] = {
    "condensation": ("condensation", {}),
    "condensation that resamples when it must": ("condensation", {"resampling_threshold": 0.5}),
    "condensation, residual": ("condensation", {"resampling": "residual"}),
    "apf, corrected": ("apf", {"apf_weights": "corrected"}),
    "apf, balanced, stratified": ("apf", {"apf_weights": "balanced", "resampling": "stratified"}),
    "h-spf, corrected": ("h-spf", {"apf_weights": "corrected", "gamma_px": 4.0}),
    "s-spf, corrected": ("s-spf", {"apf_weights": "corrected", **NARROW}),
    "s-spf, balanced, multinomial": ("s-spf", {"apf_weights": "balanced", "resampling": "multinomial", **NARROW}),
    "upf": ("upf", {"measurement_noise_px": 8.0}),
}
"""All that sample the posterior itself; `sharpened` weights sample something else, and say so."""


Exact = tuple[NDArray[np.float64], NDArray[np.float64], float]
"""The posterior of one frame as the grid has it: mean, deviation, and the logarithm of the evidence."""


def parameters(**values: Value) -> BallTrackerParameters:
    return revise(BallTrackerParameters(), {**AT_REST, **values})


def picture(index: int) -> NDArray[np.uint8]:
    """A ball that goes to the right below a look-alike, and is behind a pillar in frame 3."""
    image = np.full((HEIGHT, WIDTH, 3), 100, np.uint8)
    paint_disc(image, 24.0 + 3 * index, 22.0, 4.0, RED)
    paint_disc(image, 34.0, 32.0, 3.0, RED)
    if index == 3:
        image[:, 26:44] = 90
    return image


FRAMES = [Frame(index, index / 30, image_rgb=picture(index)) for index in range(6)]


@cache
def by_grid(given: BallTrackerParameters, noises_px: tuple[float, ...] = (3.0,) * 5) -> list[Exact]:
    """Filter on the grid, with a process noise for each frame after the first."""
    points = np.stack(np.meshgrid(X, Y), axis=-1).reshape(-1, 2)
    density = np.outer(norm.pdf(Y, START[1], SPREAD), norm.pdf(X, START[0], SPREAD)) / PER_PX**2
    exact = []
    for frame, noise_px in zip(FRAMES[1:], noises_px, strict=True):
        across, down = (norm.pdf(side[:, None] - side, scale=noise_px) / PER_PX for side in (X, Y))
        scores = chromaticity.log_likelihood(frame.image_rgb, points, colour_model(given), given.background_level)
        weighed = (down @ density @ across.T) * np.exp(scores).reshape(len(Y), len(X))
        evidence = weighed.sum()
        density = weighed / evidence
        mean, second = (np.array([density.sum(axis=0) @ X**n, density.sum(axis=1) @ Y**n]) for n in (1, 2))
        exact.append((mean, np.sqrt(second - mean**2), float(np.log(evidence))))
    return exact


def check_exact(states: list[PointState], exact: list[Exact]) -> None:
    """Check that mean, deviation and evidence are the grid's in each frame: to 0.3 px, 5 % and 0.06 (four errors)."""
    for state, (mean, sigma, log_evidence) in zip(states, exact, strict=True):
        assert state.estimate == pytest.approx(mean, abs=0.3)
        assert state.sigma == pytest.approx(sigma, rel=0.05)
        assert state.log_evidence == pytest.approx(log_evidence, abs=0.06)


def followed(tracker: str, given: BallTrackerParameters, seed: int = 1, frames: int = 5) -> list[Any]:
    member, states = TRACKERS[tracker], []
    state = member.start(Target(START, 8.0), FRAMES[0], given, Stream(seed, 0, Purpose.START))
    for frame in FRAMES[1 : frames + 1]:
        state = member.step(state, frame, given, Stream(seed, frame.index, Purpose.TRACK))
        states.append(state)
    return states


@pytest.mark.parametrize("name", VALID)
def test_every_valid_sampler_comes_to_the_posterior(name: str) -> None:
    """With many particles mean, deviation and evidence are the grid's."""
    tracker, values = VALID[name]
    given = parameters(sample_count=20_000, **values)
    check_exact(followed(tracker, given), by_grid(given))


@pytest.mark.parametrize("gamma_px", [0.0, 5.0])
def test_process_noise_control_is_exact_with_the_noise_that_it_chose(gamma_px: float) -> None:
    """The large noise is used in the frames after one whose deviation exceeds gamma, and the other one else."""
    given = parameters(sample_count=20_000, gamma_px=gamma_px, large_process_noise_px=6.0)
    states = followed("pc-pf", given)
    widths = [SPREAD, *(float(state.sigma.max()) for state in states[:-1])]
    noises = tuple(6.0 if width > gamma_px else 3.0 for width in widths)
    assert [state.alert for state in states] == [noise == 6.0 for noise in noises]
    assert not gamma_px or len(set(noises)) == 2
    check_exact(states, by_grid(given, noises))


@pytest.mark.parametrize(
    "name", ["condensation that resamples when it must", "apf, corrected", "s-spf, balanced, multinomial", "upf"]
)
def test_the_evidence_is_not_biased(name: str) -> None:
    """With forty particles the mean over many seeds of two evidences multiplied is the exact one, to four errors."""
    tracker, values = VALID[name]
    given = parameters(sample_count=40, **values)
    exact = sum(log_evidence for _, _, log_evidence in by_grid(given)[:2])
    totals = [sum(state.log_evidence for state in followed(tracker, given, seed, 2)) for seed in range(200)]
    ratios = np.exp(np.array(totals) - exact)
    error = ratios.std() / np.sqrt(len(ratios))
    assert error < 0.05
    assert ratios.mean() == pytest.approx(1.0, abs=4 * error)
