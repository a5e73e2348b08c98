"""Randomness that does not depend on how one got there.

Every random number of a run is a pure function of the run's seed, the frame and the purpose it serves. The generator
is counter-based (Philox, Salmon et al. 2011): instead of a hidden state that advances, it enciphers a counter under a
key, so a run can seek, rewind and replay and still meet the same numbers, and two filters on the same seed watch a
scene with the same noise (common random numbers).
"""

from enum import IntEnum

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

__all__ = ["MAXIMUM_SEED", "Purpose", "generator"]

MAXIMUM_SEED = 2**63 - 1


class Purpose(IntEnum):
    """What random numbers are for; each purpose has a stream of its own."""

    START = 0
    TRACK = 1
    SCENE = 2


def generator(seed: int, frame: int, purpose: Purpose) -> np.random.Generator:
    """Return the generator of one frame and purpose.

    Args:
        seed: The run's seed, 0..2**63-1.
        frame: Frame index, not negative.
        purpose: What the numbers are for.

    Raises:
        ValueError: The seed or the frame is out of range.
    """
    if not 0 <= seed <= MAXIMUM_SEED:
        raise ValueError(f"the seed must be a whole number between 0 and {MAXIMUM_SEED}, got {seed}")
    if frame < 0:
        raise ValueError(f"the frame must not be negative, got {frame}")
    key = _Key(np.array([seed, purpose], dtype=np.uint64))
    counter = np.array([0, 0, frame, 0], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key, counter=counter))  # type: ignore[arg-type] # NumPy's stub omits it


class _Key(ISeedSequence):
    """A Philox key in the place of a seed; given as `key=`, NumPy would first gather entropy and throw it away."""

    def __init__(self, words: NDArray[np.uint64]) -> None:
        self._words = words

    def generate_state(self, n_words: int, dtype: object = np.uint32) -> NDArray[np.uint64]:
        """Return the key, which is all that Philox asks for."""
        del n_words, dtype
        return self._words
