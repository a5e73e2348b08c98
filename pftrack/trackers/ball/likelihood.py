"""What the loop weighs particles of a ball by: the colour of the pixel under them."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.likelihoods.chromaticity import ColourModel, log_kernel
from pftrack.numerics.compiled import compiled
from pftrack.trackers.ball.parameters import ColourParameters
from pftrack.trackers.sampling.likelihood import Likelihood

__all__ = ["CHROMATICITY", "Colour", "colour_model"]


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
def _pack(parameters: ColourParameters) -> Colour:
    model = colour_model(parameters)
    return Colour(model.mean, model.precision, parameters.background_level)


CHROMATICITY = Likelihood(_log_likelihood, _pack)
"""The colour of the pixel under a particle (Bando 2007, ch. 3 section 2.2)."""
