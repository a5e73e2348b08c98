"""What the loop weighs particles of a ball by, the colour of the pixel under them, and what that is made of."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.likelihood import Component, ObservationLikelihood
from pftrack.core.model.part import Amount, Part, Patches, Residual
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.experiments.ball.trackers.parameters import ColourParameters
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import centre_of, crop, picture_of
from pftrack.experiments.shared.sampling.likelihood import Likelihood
from pftrack.vision.likelihoods.chromaticity import ColourModel, log_kernel

__all__ = ["CHROMATICITY", "LIKELIHOOD", "Colour", "colour_model"]

COMPONENTS = (Component("u", "px"), Component("v", "px"), Component("u before", "px"), Component("v before", "px"))

SHOWN_PX = 5
"""Pixels to either side of the one that is weighed, which are shown with it."""


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


def _weigh(
    state: PointState, states: NDArray[np.float64], frame: Frame, parameters: ColourParameters
) -> NDArray[np.float64]:
    del state
    weighed: NDArray[np.float64] = CHROMATICITY.log_likelihood(
        read_only(picture_of(frame)), np.ascontiguousarray(states.T).T, CHROMATICITY.packed(parameters)
    )
    return weighed


def _parts(state: PointState, one: NDArray[np.float64], frame: Frame, parameters: ColourParameters) -> tuple[Part, ...]:
    """Return the colour of the pixel beside the target's, in the shares that are compared."""
    del state
    image, model = picture_of(frame), colour_model(parameters)
    around = crop(image, one[:2], (SHOWN_PX, SHOWN_PX))
    shares = np.full(2, np.nan)
    pixel = crop(image, one[:2], (0, 0)).reshape(-1).astype(np.float64)
    if pixel.sum() > 0.0:
        shares = pixel[:2] / pixel.sum()
    residuals = tuple(
        Residual(f"share of {name}", float(found), expected, spread)
        for name, found, expected, spread in zip(("red", "green"), shares, model.mean, model.spread, strict=True)
        if np.isfinite(spread)
    )
    red, green = model.mean
    blue = max(1.0 - red - green, 0.0)
    brightest = max(red, green, blue)
    colour = np.rint(255.0 * np.array([[[red, green, blue]]]) / brightest).astype(np.uint8)
    background = Amount("background level rho", parameters.background_level)
    return (*residuals, background, Patches("colour expected, and found around the pixel", colour, around))


LIKELIHOOD = ObservationLikelihood(
    "colour of the pixel",
    components=lambda _: COMPONENTS,
    log_likelihood=_weigh,
    centre=centre_of,
    parts=_parts,
    most_places=19_200,
)
"""The same, to be asked at any place."""
