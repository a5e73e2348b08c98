import numpy as np
import pytest
from scipy import stats

from pftrack.core.numerics.random import LARGEST_KEY, Purpose, Stream, standard_normals, uniforms
from pftrack.core.numerics.random import _philox as philox

# From the authors' own tests (Random123, kat_vectors), Philox 4x32 with ten rounds: key, counter, enciphered words.


def test_seed_frame_purpose_and_draw_give_independent_streams() -> None:
    """Changing any of seed, frame and purpose gives numbers without correlation, and so does drawing again.

    A frame's numbers are the same whether or not other frames were visited first.
    """
    stream, purpose = Stream(7, 41, Purpose.TRACK), Purpose.TRACK
    first = stream.standard_normal(20_000)
    others = [(8, 41, purpose), (7 + 2**40, 41, purpose), (7, 42, purpose), (7, 41, Purpose.SCENE)]
    for other in (stream, *(Stream(*keys) for keys in others)):
        assert abs(np.corrcoef(first, other.standard_normal(20_000))[0, 1]) < 0.03
    assert np.array_equal(first, Stream(7, 41, Purpose.TRACK).standard_normal(20_000))


def _textbook(low: int, high: int, a: int, b: int, c: int, d: int) -> tuple[int, int, int, int]:
    for _ in range(10):
        first, second = a * 0xD2511F53, c * 0xCD9E8D57
        a, b, c, d = (second >> 32) ^ b ^ low, second % 2**32, (first >> 32) ^ d ^ high, first % 2**32
        low, high = (low + 0x9E3779B9) % 2**32, (high + 0xBB67AE85) % 2**32
    return a, b, c, d


def test_the_cipher_is_the_textbook_one_for_any_key_and_counter() -> None:
    """Philox 4x32-10 gives what its authors publish, and what ten rounds written out in Python's integers give."""
    # From their own tests (Random123, kat_vectors), of key and counter 0.
    assert philox(0, 0, 0, 0, 1)[:, 0].tolist() == [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]
    for low, high, draw, frame in np.random.default_rng(3).integers(2**31, size=(50, 4)).tolist():
        words = philox(low + (high << 32), frame, 2, draw, 3)
        assert tuple(words[:, 2].tolist()) == _textbook(low, high, 2, draw, frame, 2)


def test_normals_are_normal_and_uniforms_uniform() -> None:
    """400,000 of each pass Kolmogorov and Smirnov's test; neighbours and lanes of a counter have no correlation."""
    normals = standard_normals(1, 2, Purpose.TRACK.value, 0, 400_000)
    assert stats.kstest(normals, "norm").pvalue > 0.01
    assert stats.kstest(uniforms(1, 2, Purpose.TRACK.value, 1, 400_000), "uniform").pvalue > 0.01
    moments = [float((normals**power).mean()) for power in (1, 2, 3, 4)]
    assert moments == pytest.approx([0, 1, 0, 3], abs=0.02)
    for lag in (1, 2, 100_000, 200_000, 300_000):
        for pair in ((normals[:-lag], normals[lag:]), (normals[:-lag] ** 2, normals[lag:] ** 2)):
            assert abs(np.corrcoef(*pair)[0, 1]) < 0.012


@pytest.mark.parametrize("size", [0, 1, 5, 800, (2, 3, 4), None])
def test_any_number_of_numbers_can_be_drawn(size: int | tuple[int, ...] | None) -> None:
    """A draw has as many numbers as asked for, all finite, the uniform ones within [0, 1); no size gives a float.

    A seed or frame out of range is refused with a sentence that names the bound.
    """
    stream = Stream(3, 3, Purpose.TRACK)
    normals, flat = stream.standard_normal(size), np.asarray(stream.random(size))
    assert np.shape(normals) == flat.shape == (() if size is None else np.zeros(size).shape)
    assert np.isfinite(normals).all()
    assert ((flat >= 0) & (flat < 1)).all()
    assert isinstance(Stream(0, 0, Purpose.START).random(), float)
    for seed, frame in ((-1, 0), (LARGEST_KEY + 1, 0), (0, 2**32)):
        with pytest.raises(ValueError, match="must be a whole number between"):
            Stream(seed, frame, Purpose.START)
