"""The numbers of a linear Gaussian model that make what was seen most probable, by expectation maximisation."""

from collections.abc import Sequence
from dataclasses import dataclass

from pftrack.core.model.linear import LinearChain, NoiseScale
from pftrack.filters.learning.noise_em import fit_noise

__all__ = ["LinearHalf", "maximise_linear"]


@dataclass(frozen=True, slots=True, eq=False)
class LinearHalf:
    """The half of a run that numbers are fitted to, as a linear model.

    Attributes:
        chains: The model, with the values to begin with.
        scales: What each number scales.
    """

    chains: tuple[LinearChain, ...]
    scales: tuple[NoiseScale, ...]


def maximise_linear(
    half: LinearHalf, begin: Sequence[float], bounds: Sequence[tuple[float, float]]
) -> tuple[tuple[float, ...], int]:
    """Return the values under which the half is most probable, and how many steps they took.

    Args:
        half: What was seen.
        begin: The values with which its chains were made, positive.
        bounds: Least and largest value of each number.
    """
    numbers = tuple(zip(half.scales, begin, bounds, strict=True))
    reach = {scale.kind: (scale.factor(value, low), scale.factor(value, high)) for scale, value, (low, high) in numbers}
    found = fit_noise(half.chains, reach)
    values = (scale.scale(value, found.factors[scale.kind]) for scale, value, _ in numbers)
    inside = (min(max(value, low), high) for value, (low, high) in zip(values, bounds, strict=True))
    return tuple(inside), found.steps
