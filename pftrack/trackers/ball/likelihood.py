"""What the loop weighs particles by: any compiled likelihood of pictures, with its parameters packed for compiled code.

A family of trackers that follows something else than a colour reuses loop and samplers with a `Likelihood` of its own:

    class Histogram(NamedTuple):
        reference: NDArray[np.float64]

    @compiled
    def log_likelihood(image_rgb, states, histogram): ...

    LIKELIHOOD = Likelihood(log_likelihood, lambda parameters: Histogram(...))
    TRACKERS = loop_trackers(LIKELIHOOD)
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.compiled import compiled
from pftrack.likelihoods.chromaticity import ColourModel, log_kernel
from pftrack.trackers.ball.loop import LogLikelihood, loop_with
from pftrack.trackers.ball.parameters import ColourParameters

__all__ = ["CHROMATICITY", "Colour", "Likelihood", "colour_model"]


@dataclass(frozen=True)
class Likelihood:
    """p(z | x) of a picture.

    Attributes:
        log_likelihood: (picture, states (N, d), packed parameters) -> (N,); compiled.
        packed: Parameters of the tracker -> a named tuple of what the function needs of them.
        loop: The loop that weighs by it.
    """

    log_likelihood: LogLikelihood
    packed: Callable[[Any], tuple[Any, ...]]
    loop: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Build the loop; it is compiled when it runs first."""
        object.__setattr__(self, "loop", loop_with(self.log_likelihood))


class Colour(NamedTuple):
    """What the target looks like, as `chromaticity.log_kernel` takes it."""

    mean: tuple[float, float]
    precision: tuple[float, float]
    background_level: float


def colour_model(parameters: ColourParameters) -> ColourModel:
    """Return the colour that the parameters describe."""
    green = parameters.green_spread if parameters.colour_model == "chromaticity" else np.inf
    return ColourModel((parameters.target_red_share, parameters.target_green_share), (parameters.red_spread, green))


@compiled
def _log_likelihood(image_rgb: NDArray[np.uint8], states: NDArray[np.float64], colour: Colour) -> NDArray[np.float64]:
    return log_kernel(image_rgb, states, colour.mean, colour.precision, colour.background_level)


@lru_cache(maxsize=64)
def _packed(parameters: ColourParameters) -> Colour:
    model = colour_model(parameters)
    return Colour(model.mean, model.precision, parameters.background_level)


CHROMATICITY = Likelihood(_log_likelihood, _packed)
"""The colour of the pixel under a particle (document 1, ch. 3 section 2.2)."""
