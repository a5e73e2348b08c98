"""The loop with another likelihood than the ball's colour, as another family of trackers uses it."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.ball.model import COLOURED, Coloured, LoopParameters
from pftrack.experiments.ball.model import dynamics_of as dynamics
from pftrack.experiments.shared.filtered import filtered
from pftrack.experiments.shared.sampling import AUXILIARY, CONDENSATION, HARD
from pftrack.filters import auxiliary, bootstrap

SIZE = (160, 120)
ROWS, COLUMNS = np.mgrid[: SIZE[1], : SIZE[0]]
GREY = 250 * np.exp(-((COLUMNS - 80) ** 2 + (ROWS - 60) ** 2) / (2 * 15.0**2))
PICTURE = np.repeat(GREY.astype(np.uint8)[:, :, None], 3, axis=2)


class Brightness(NamedTuple):
    """How bright the target is, and how sharply a particle is weighed by it."""

    level: float
    precision: float


@compiled
def log_likelihood(
    image_rgb: NDArray[np.uint8], states: NDArray[np.float64], brightness: Brightness
) -> NDArray[np.float64]:
    """A Gaussian of the green channel under the particle; the nearest pixel where it is beyond the picture."""
    scores = np.empty(states.shape[0])
    for n in range(states.shape[0]):
        column = min(max(int(np.floor(states[n, 0] + 0.5)), 0), image_rgb.shape[1] - 1)
        row = min(max(int(np.floor(states[n, 1] + 0.5)), 0), image_rgb.shape[0] - 1)
        scores[n] = -brightness.precision * (image_rgb[row, column, 1] - brightness.level) ** 2
    return scores


PACKED = Brightness(250.0, 0.001)


class Bright(Coloured):
    """A point that moves like a ball, and is bright."""

    def pack(self, known: object, parameters: object) -> Brightness:
        """Return the brightness."""
        return PACKED


TRACKERS = filtered(Bright(log_likelihood), CONDENSATION, AUXILIARY, HARD)
PARAMETERS = revise(LoopParameters(), {"sample_count": 300, "initial_sd_px": 12.0, "apf_weights": "corrected"})
FRAME = Frame(1, 0.0, image_rgb=PICTURE)


@pytest.mark.parametrize(("tracker", "observed"), [("condensation", 0), ("apf", 300), ("h-spf", 300)])
def test_the_loop_weighs_by_any_likelihood(tracker: str, observed: int) -> None:
    """With a likelihood of one's own the loop gives the particles of the filters with that likelihood, to the bit."""
    member, counts = TRACKERS[tracker], {"prediction_count": 0, "observation_count": observed}
    state = member.start(Target(np.array([74.0, 63.0]), 12.0), FRAME, PARAMETERS, Stream(1, 0, Purpose.START))
    stepped = member.step(state, FRAME, PARAMETERS, Stream(9, 1, Purpose.TRACK))
    rng, model = Stream(9, 1, Purpose.TRACK), dynamics(state, PARAMETERS, SIZE)

    def weigh(states: NDArray[np.float64]) -> NDArray[np.float64]:
        return log_likelihood(PICTURE, states, PACKED)

    if observed:
        expected = auxiliary.step(state.particles, model, weigh, rng, weights="corrected", **counts)
    else:
        expected = bootstrap.step(state.particles, model, weigh, rng)
    assert np.array_equal(stepped.particles.states, expected.particles.states)
    assert np.array_equal(stepped.particles.log_weights, expected.particles.log_weights)
    assert (stepped.log_evidence, stepped.observation_count) == (expected.log_evidence, observed)


def test_each_likelihood_has_a_compiled_loop_of_its_own() -> None:
    """A second likelihood neither replaces the first one's loop nor shares its place in the cache on disk."""
    first, second = COLOURED, TRACKERS["apf"].model
    assert isinstance(second, Coloured)
    assert first.loop is not second.loop
    assert first.loop.__qualname__ != second.loop.__qualname__
