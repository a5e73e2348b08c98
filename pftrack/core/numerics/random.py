"""Random numbers that do not depend on the history of a run.

Every random number of a run is a pure function of the run's seed, the frame, the purpose it serves and its place in the
draw. The generator is counter-based (Philox 4x32-10; Salmon, Moraes, Dror and Shaw 2011): instead of advancing a hidden
state, it enciphers a counter under a key. So a run can seek, rewind and replay with the same numbers, and two filters
with the same seed see a scene with the same noise (common random numbers).

`uniforms` and `standard_normals` are the numbers themselves, for compiled loops; a `Stream` returns them draw by draw
and replaces NumPy's generator in the filters. Without a state to wait for, many numbers are computed at a time, seven
times as fast as NumPy's.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import logarithms
from pftrack.core.numerics.matrices import cholesky, factorise, product, substitute

LARGEST_SEED = 2**53 - 1
"""Largest seed that users may choose: JSON in a browser does not carry larger numbers exactly."""

LARGEST_KEY = 2**63 - 1
"""Largest seed that the generator takes: runs saved by earlier versions may exceed the bound above."""

MAXIMUM_FRAME = 2**32 - 1


class Purpose(IntEnum):
    """Purposes of random numbers; each has its own stream."""

    START = 0
    TRACK = 1
    SCENE = 2


class Generator(Protocol):
    """The interface of random numbers that filters need; a `Stream` and NumPy's generator have it."""

    def random(self, size: Any = None) -> Any:  # noqa: ANN401 - as NumPy types it
        """Return numbers uniform in [0, 1), of the given shape, or one number."""

    def standard_normal(self, size: Any = None) -> Any:  # noqa: ANN401 - as NumPy types it
        """Return independent N(0, 1) numbers of the given shape, or one number."""


class Stream:
    """The random numbers of one seed, frame and purpose, draw by draw."""

    def __init__(self, seed: int, frame: int, purpose: Purpose) -> None:
        """Begin at the first draw.

        Args:
            seed: The run's seed, 0..LARGEST_KEY.
            frame: Frame index, not negative.
            purpose: Purpose of the numbers.

        Raises:
            ValueError: The seed or the frame is out of range.
        """
        if not 0 <= seed <= LARGEST_KEY:
            raise ValueError(f"the seed must be a whole number between 0 and {LARGEST_KEY}, got {seed}")
        if not 0 <= frame <= MAXIMUM_FRAME:
            raise ValueError(f"the frame must be a whole number between 0 and {MAXIMUM_FRAME}, got {frame}")
        self.seed = seed
        self.frame = frame
        self.purpose = purpose
        self._key = int(purpose)  # once: looking up the value of an enumeration takes half a microsecond
        self._draws = 0

    def random(self, size: Any = None) -> Any:  # noqa: ANN401 - a number or an array, as NumPy's does
        """Return numbers uniform in [0, 1), of the given shape, or one number."""
        return self._shape(uniforms, size)

    def standard_normal(self, size: Any = None) -> Any:  # noqa: ANN401 - a number or an array, as NumPy's does
        """Return independent N(0, 1) numbers of the given shape, or one number."""
        return self._shape(standard_normals, size)

    def _shape(self, draw: Any, size: Any) -> Any:  # noqa: ANN401 - see above
        count = 1 if size is None else math.prod(size) if isinstance(size, tuple) else int(size)
        numbers = draw(self.seed, self.frame, self._key, self._draws, count)
        self._draws += 1
        return float(numbers[0]) if size is None else numbers.reshape(size)


def numpy_generator(seed: int, frame: int, purpose: int) -> np.random.Generator:
    """Return NumPy's generator of a frame: the same on every way to it, since the counter holds the frame."""
    return np.random.Generator(np.random.Philox(key=[seed, purpose], counter=[0, 0, 0, frame]))


@compiled
def uniforms(seed: int, frame: int, purpose: int, draw: int, count: int) -> Floats:
    """Return (count,) numbers uniform in [0, 1) with 53 bits, given seed, frame, purpose and number of the draw."""
    blocks = (count + 1) // 2
    words = _philox(seed, frame, purpose, draw, blocks)
    numbers = np.empty((2, blocks))
    for pair in range(2):
        for block in range(blocks):
            # Conversion by signed 32 bits, the only integers that AVX2 converts to floating point.
            high = float(np.int32(words[2 * pair, block] >> np.uint64(5)))
            low = float(np.int32(words[2 * pair + 1, block] >> np.uint64(6)))
            numbers[pair, block] = (high * 67108864.0 + low) / 9007199254740992.0
    return numbers.ravel()[:count]


@compiled
def standard_normals(seed: int, frame: int, purpose: int, draw: int, count: int) -> Floats:
    """Return (count,) independent N(0, 1) numbers, given seed, frame, purpose and number of the draw.

    Box and Muller's transform of two 32-bit words into two numbers: a radius and an angle. The greatest possible
    magnitude is 6.8.
    """
    blocks = (count + 3) // 4
    words = _philox(seed, frame, purpose, draw, blocks)
    numbers = np.empty((4, blocks))
    shares = np.empty(blocks)
    for pair in range(2):
        for block in range(blocks):
            # Conversion by signed 32 bits, the only integers that AVX2 converts to floating point.
            share = np.int32(words[pair, block] ^ np.uint64(0x80000000))
            shares[block] = (float(share) + (2147483648.0 + 0.5)) * 2.0**-32
        logs = logarithms(shares)
        for block in range(blocks):
            word = np.int64(words[2 + pair, block])
            # Thirty bits give an angle within 45 degrees of an axis, two bits the axis.
            angle = (float(np.int32(word >> 2)) - 536870911.5) * (np.pi / 2.0**31)
            sine, cosine = _sine(angle), _cosine(angle)
            radius = np.sqrt(-2.0 * logs[block])
            signed = radius if word & 2 else -radius
            numbers[2 * pair, block] = signed * (sine if word & 1 else cosine)
            numbers[2 * pair + 1, block] = signed * (cosine if word & 1 else sine)
    return numbers.ravel()[:count]


@compiled
def _sine(angle: float) -> float:
    """Return sin x for |x| <= pi/4, by fdlibm's polynomial."""
    square = angle * angle
    series = square * (-2.50507602534068634195e-08 + square * 1.58969099521155010221e-10)
    series = square * (-1.98412698298579493134e-04 + square * (2.75573137070700676789e-06 + series))
    series = square * (-1.66666666666666324348e-01 + square * (8.33333333332248946124e-03 + series))
    return angle + angle * series


@compiled
def _cosine(angle: float) -> float:
    """Return cos x for |x| <= pi/4, by fdlibm's polynomial."""
    square = angle * angle
    series = square * (2.08757232129817482790e-09 + square * -1.13596475577881948265e-11)
    series = square * (2.48015872894767294178e-05 + square * (-2.75573143513906633035e-07 + series))
    series = square * square * (4.16666666666666019037e-02 + square * (-1.38888888888741095749e-03 + series))
    return 1.0 - (0.5 * square - series)


@compiled
def _philox(seed: int, frame: int, purpose: int, draw: int, blocks: int) -> NDArray[np.uint64]:
    """Return (4, blocks) words of 32 bits: the counters (block, draw, frame, purpose) enciphered under the seed."""
    low, shift = np.uint64(0xFFFFFFFF), np.uint64(32)
    first_factor, second_factor = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
    first_step, second_step = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
    words = np.empty((4, blocks), np.uint64)
    for block in range(blocks):
        a, b, c, d = np.uint64(block), np.uint64(draw), np.uint64(frame), np.uint64(purpose)
        first_key, second_key = np.uint64(seed) & low, np.uint64(seed) >> shift
        for _ in range(10):
            # Both factors have 32 bits; the compiler then needs one instruction for the product.
            first, second = (a & low) * first_factor, (c & low) * second_factor
            a = (second >> shift) ^ b ^ first_key
            b = second & low
            c = (first >> shift) ^ d ^ second_key
            d = first & low
            first_key = (first_key + first_step) & low
            second_key = (second_key + second_step) & low
        words[0, block], words[1, block], words[2, block], words[3, block] = a, b, c, d
    return words


@dataclass(frozen=True)
class Gaussian:
    """N(mean, covariance).

    Attributes:
        mean: (d,).
        covariance: (d, d), symmetric, not negative.
    """

    mean: Floats
    covariance: Floats

    @cached_property
    def standard_deviations(self) -> Floats:
        """(d,) square roots of the variances."""
        deviations: Floats = np.sqrt(self.covariance.diagonal())
        return deviations

    def sample(self, rng: Generator, count: int) -> Floats:
        """Draw (count, d) samples; the covariance may be singular."""
        normals = rng.standard_normal((count, len(self.mean)))
        samples: Floats = self.mean + product(normals, cholesky(self.covariance).T)
        return samples


def log_density(points: Floats, means: Floats, covariance: Floats) -> Floats:
    """Return log N(x | m, P).

    Args:
        points: (..., d).
        means: (..., d), broadcast against the points.
        covariance: (d, d) or (..., d, d), positive definite.

    Raises:
        numpy.linalg.LinAlgError: The covariance is not positive definite.
    """
    differences = np.subtract(points, means)
    dimension = differences.shape[-1]
    shape = differences.shape[:-1]
    one = np.ndim(covariance) == 2
    spread = covariance if one else np.broadcast_to(covariance, (*shape, dimension, dimension))
    densities, positive = log_densities(
        np.ascontiguousarray(differences.reshape(-1, dimension), np.float64),
        np.array(spread, np.float64).reshape(-1, dimension, dimension),
    )
    if not positive:
        raise np.linalg.LinAlgError("Matrix is not positive definite")
    return densities.reshape(shape)


@compiled
def log_densities(differences: Floats, covariances: Floats) -> tuple[Floats, bool]:
    """Return log N(x | 0, P), (n,), of points (n, d), and whether all covariances are positive definite.

    Args:
        differences: (n, d) of the points from their means.
        covariances: (n, d, d), or (1, d, d) for all.
    """
    count, dimension = differences.shape
    densities = np.empty(count)
    lower = np.empty((dimension, dimension))
    constant = 0.0
    for n in range(count):
        if n < covariances.shape[0]:
            lower, positive = factorise(covariances[n])
            if not positive:
                return densities, False
            constant = dimension * np.log(2.0 * np.pi)
            for i in range(dimension):
                constant += 2.0 * np.log(lower[i, i])
        whitened = substitute(lower, differences[n].copy().reshape(dimension, 1))
        square = 0.0
        for i in range(dimension):
            square += whitened[i, 0] * whitened[i, 0]
        densities[n] = -0.5 * (square + constant)
    return densities, True


def symmetrise(covariance: Floats) -> Floats:
    """Return the symmetric part of (..., d, d), which rounding must not lose."""
    return 0.5 * (covariance + np.swapaxes(covariance, -1, -2))
