"""The Kalman filter beside the particle filter on a signal in noise (Bando 2007, ch. 2).

The model is linear and the noise Gaussian, so the exact answer is known, and what a particle filter loses by sampling
can be seen: with few particles, and with more dimensions than they can fill.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import COLOURS, Drawing, Picture, Points, Polyline, Primitive
from pftrack.core.model.setup import Setup
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.sketch import at_height, caption, circle, particle_clouds
from pftrack.experiments.sine.model import MODEL, TRACKERS, SignalParameters, SignalSource, SignalTrackerParameters
from pftrack.filters import kalman

FOLDER = Path(__file__).parent

WIDTH, HEIGHT, MARGIN = 720, 400, 40
WINDOW_FRAMES = 360
SPAN = 1.6
"""The drawing shows values between -SPAN and SPAN."""


class SineParameters(SignalTrackerParameters, SignalParameters):
    """The signal and its trackers."""

    @property
    def assumed_noise_share(self) -> float:
        """The noise that filters assume, relative to that of what is seen."""
        return self.assumed_noise_sd / self.observation_noise_sd

    @property
    def kalman_lag(self) -> float:
        """By how many of its standard deviations the Kalman filter lags where the signal bends most, about."""
        bend = (2.0 * np.pi / SignalSource.period_frames) ** 2
        return kalman.steady_lag(bend, self.process_noise_sd, self.assumed_noise_sd)


def simulate() -> Setup:
    """Wire the signal with Bando's values."""
    return Setup(SignalSource, SineParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw the first copy of the signal over time: truth, what is seen, the estimate and its band, the particles."""
    row = step.diagnostics
    first = max(row.frame - WINDOW_FRAMES, 0)
    rows = past[first : row.frame + 1]
    frames = np.array([past_row.frame for past_row in rows], dtype=np.float64) - first
    estimates = np.array([past_row.estimate[0] for past_row in rows])
    sigmas = np.array([past_row.sigma[0] for past_row in rows])
    primitives: dict[str, Primitive] = {"picture": Picture(_paper())}
    seen = [
        (frame, past_row.observation[0]) for frame, past_row in zip(frames, rows, strict=True) if past_row.observation
    ]
    if seen:
        points = _curve(np.array([frame for frame, _ in seen]), np.array([value for _, value in seen]))
        grey = np.full((len(points), 3), COLOURS["hidden"], dtype=np.uint8)
        primitives["observations"] = Points(points, grey, 2.0, "observations")
    truths = np.array([past_row.truth[0] for past_row in rows if past_row.truth])
    primitives["truth"] = Polyline(_curve(frames, truths), COLOURS["truth"], 2.0, "truth")
    for name, sign in (("upper", 2.0), ("lower", -2.0)):
        band = _curve(frames, estimates + sign * sigmas)
        primitives[name] = Polyline(band, COLOURS["observation"], 1.0, "uncertainty")
    references = [past_row.vector("exact") for past_row in rows]
    exact = np.array([reference[0] for reference in references if reference])
    if len(exact) == len(frames):
        primitives["exact"] = Polyline(_curve(frames, exact), COLOURS["second"], 2.0, "exact (Kalman)")
    primitives["estimate"] = Polyline(_curve(frames, estimates), COLOURS["estimate"], 2.0, "estimate")
    newest = _curve(frames[-1:], estimates[-1:])[0, :2].astype(np.float64)
    primitives["now"] = circle(newest, 5.0, COLOURS["estimate"], "estimate")
    if other is not None:
        there = _curve(frames[-1:], np.array(other.estimate[:1]))[0, :2].astype(np.float64)
        primitives["second"] = circle(there, 5.0, COLOURS["second"], "second run")
    particles = step.state.particles
    if particles is not None:
        positions = _curve(np.full(len(particles), frames[-1]), particles.states[:, 0])[:, :2].astype(np.float64)
        primitives |= particle_clouds(positions, particles, 0, 4.0)
    return Drawing(WIDTH, HEIGHT, primitives, _caption(step))


def _caption(step: Step) -> str:
    row = step.diagnostics
    return caption(row, step.tracker_title, "" if row.error is None else f"error {row.error:.3f}")


def _curve(frames: Floats, values: Floats) -> NDArray[np.float32]:
    across = MARGIN + frames * (WIDTH - 2 * MARGIN) / WINDOW_FRAMES
    down = HEIGHT / 2 - np.clip(values, -SPAN, SPAN) * (HEIGHT / 2) / SPAN
    return at_height(np.stack([across, down], axis=1), 1.0)


@cache
def _paper() -> NDArray[np.uint8]:
    """White paper with lines at -1, 0 and 1."""
    paper = np.full((HEIGHT, WIDTH, 3), 255, dtype=np.uint8)
    for value in (-1.0, 0.0, 1.0):
        down = round(HEIGHT / 2 - value * (HEIGHT / 2) / SPAN)
        cv2.line(paper, (MARGIN, down), (WIDTH - MARGIN, down), (221, 221, 221), 1)
        cv2.putText(paper, f"{value:g}", (8, down + 4), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (96, 96, 96), 1, cv2.LINE_AA)
    paper.flags.writeable = False
    return paper


def _mean_distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    return np.abs(estimates - truths).mean(axis=-1)


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS),
    id="sine",
    quality=read_quality(FOLDER, TRACKERS),
    model=MODEL,
    simulate=simulate,
    draw=draw,
    error=_mean_distance,
)
