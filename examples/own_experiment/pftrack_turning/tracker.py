"""The tracker: interacting multiple models (Blom and Bar-Shalom, IEEE Trans. Automatic Control 33, 1988).

Each Kalman filter of a bank assumes one rate of turn. Each is weighed by how well it foresaw the measurement, and then
their beliefs are mixed, since the target may begin to turn otherwise. While the target is hidden the hypotheses part,
and where it comes out tells which of them was right.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import parameter
from pftrack.core.model.series import Hypotheses, Interval, Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.shared.recording import RecordingParameters
from pftrack.filters import kalman
from pftrack.filters.dynamics import LinearDynamics

Array = NDArray[np.float64]
GATE_RADII, ACCELERATION_SD_PX = 3.0, 0.5
MEASUREMENT_SD_PX = 0.07
"""Standard deviation of the measured middle: the disc's edge takes whole pixels only."""
SERIES = (
    Series("places", "possible places", "px", "hypotheses", components=("x", "y")),
    Series("turn", "rate of turn", "deg", "interval"),
)


class BankParameters(RecordingParameters, group="Motion", trackers=("bank",)):
    """What the bank assumes, beside what may be laid over the pictures."""

    # fmt: off
    hypothesis_count: int = parameter(
        5, "Hypotheses", "How many rates of turn are followed at once.",
        within=(1, 9, 2))
    turn_deg: float = parameter(
        8, "Sharpest turn", "The largest rate of turn to either side, per frame.",
        unit="deg", within=(0, 30, 0.5))
    persistence: float = parameter(
        0.9, "Persistence", "Probability that the target goes on turning as it did in the frame before.",
        within=(0, 1, 0.01))
    # fmt: on


@dataclass(frozen=True)
class Bank:
    """The posterior: K Gaussians over (x, y, vx, vy), their (K,) weights and rates of turn, and the target's look."""

    parts: tuple[Gaussian, ...]
    weights: Array
    turns_rad: Array
    radius_px: float
    levels: tuple[float, float]
    log_evidence: float = 0.0
    nbytes: int = 8192

    @property
    def whole(self) -> Gaussian:
        """The Gaussian with the mixture's moments."""
        means = np.array([part.mean for part in self.parts])
        apart = means - self.weights @ means
        within = np.einsum("k,kij->ij", self.weights, [part.covariance for part in self.parts])
        return Gaussian(self.weights @ means, within + (self.weights[:, None] * apart).T @ apart)

    @property
    def estimate(self) -> Array:
        """(2,) mean position of all hypotheses, px."""
        return self.whole.mean[:2]

    @property
    def sigma(self) -> Array:
        """(2,) standard deviations of the position, px."""
        return self.whole.standard_deviations[:2]

    def arrays(self) -> Mapping[str, Array]:
        """Return the hypotheses, for a file."""
        return {"means": np.array([part.mean for part in self.parts]), "weights": self.weights}


def turns(several: bool, parameters: BankParameters) -> Array:
    """Return the rates of turn that are followed, rad a frame: several to either side, or none at all."""
    count = parameters.hypothesis_count if several else 1
    return np.deg2rad(np.linspace(-1, 1, count) * parameters.turn_deg) if count > 1 else np.zeros(1)


def start(several: bool, target: Target, frame: Frame, parameters: BankParameters, _rng: Stream) -> Bank:
    """Begin at the mark; what is within it and around it tells what the target looks like."""
    rows, columns = np.indices(frame.image_rgb.shape[:2])
    radii = np.hypot(columns - target.position[0], rows - target.position[1]) / (target.size / 2)
    inside, around = frame.image_rgb[radii <= 0.7], frame.image_rgb[(radii > 1.3) & (radii < 3)]
    belief = Gaussian(np.array([*target.position, 0, 0]), np.diag([1, 1, target.size**2, target.size**2]))
    turns_rad, levels = turns(several, parameters), (float(inside.mean()), float(np.median(around)))
    count = len(turns_rad)
    return Bank((belief,) * count, np.full(count, 1 / count), turns_rad, target.size / 2, levels)


def step(several: bool, state: Bank, frame: Frame, parameters: BankParameters, _rng: Stream) -> Bank:
    """Predict, look, weigh and mix."""
    turns_rad = turns(several, parameters)
    count = len(turns_rad)
    if count != len(state.parts):  # each begins with what all knew together
        state = replace(state, parts=(state.whole,) * count, weights=np.full(count, 1 / count))
    parts = tuple(kalman.predict(part, arc(turn)) for part, turn in zip(state.parts, turns_rad, strict=True))
    predicted = replace(state, parts=parts, turns_rad=turns_rad, log_evidence=0.0)
    seen = look(frame.image_rgb, predicted)
    if seen is None:
        return predicted
    noise = MEASUREMENT_SD_PX**2 * np.eye(2)
    parts, logs = zip(*(kalman.update(part, seen, np.eye(2, 4), noise) for part in parts), strict=True)
    evidence = np.logaddexp.reduce(np.log(state.weights) + logs)
    weights = np.exp(np.log(state.weights) + logs - evidence)
    changes = np.full((count, count), (1 - parameters.persistence) / count) + parameters.persistence * np.eye(count)
    joint = weights[:, None] * changes
    updated = replace(predicted, parts=parts, log_evidence=float(evidence))
    mixed = tuple(replace(updated, weights=column / column.sum()).whole for column in joint.T)
    return replace(updated, parts=mixed, weights=joint.sum(axis=0))


def arc(turn_rad: float) -> LinearDynamics:
    """Return the motion along an arc, with noise on the acceleration."""
    sine, cosine = np.sin(turn_rad), np.cos(turn_rad)
    along, aside = np.sinc(turn_rad / np.pi), np.sinc(turn_rad / 2 / np.pi) * np.sin(turn_rad / 2)
    moved, turned = np.array([[along, -aside], [aside, along]]), np.array([[cosine, -sine], [sine, cosine]])
    transition = np.block([[np.eye(2), moved], [np.zeros((2, 2)), turned]])
    return LinearDynamics(transition, np.zeros(4), ACCELERATION_SD_PX * np.vstack([0.5 * np.eye(2), np.eye(2)]))


def look(image_rgb: NDArray[np.uint8], state: Bank) -> Array | None:
    """Return the middle (2,) of the target's pixels around the hypotheses, px; None where too few are seen."""
    places = np.array([part.mean[:2] for part in state.parts])
    reach, size = GATE_RADII * state.radius_px, image_rgb.shape[1::-1]
    left, top = np.clip(places.min(axis=0) - reach, 0, size).astype(int)
    right, bottom = np.clip(places.max(axis=0) + reach + 1, 0, size).astype(int)
    target, around = state.levels
    contrast = (image_rgb[top:bottom, left:right].mean(axis=2) - around) / ((target - around) or 1.0)
    rows, columns = np.nonzero(contrast > 0.5)
    enough = len(rows) > 2.5 * state.radius_px**2
    return np.array([left + columns.mean(), top + rows.mean()]) if enough else None


def measure(state: Bank) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    places = tuple((float(part.mean[0]), float(part.mean[1])) for part in state.parts)
    turns_deg = np.rad2deg(state.turns_rad)
    mean = float(state.weights @ turns_deg)
    spread = 2 * float(np.sqrt(state.weights @ (turns_deg - mean) ** 2))
    return {"places": Hypotheses(places, tuple(state.weights.tolist())), "turn": Interval(mean - spread, mean + spread)}
