import numpy as np
import pytest
from scipy import stats

from pftrack.core.numerics.random import LARGEST_KEY, Purpose, Stream, standard_normals, uniforms
from pftrack.core.numerics.random import _philox as philox

# From the authors' own tests (Random123, kat_vectors), Philox 4x32 with ten rounds: key, counter, enciphered words.
KNOWN = [
    ((0, 0), (0, 0, 0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
]


def test_numbers_do_not_depend_on_what_was_drawn_before() -> None:
    """A frame's numbers are the same whether or not other frames were visited first."""
    first = Stream(7, 41, Purpose.TRACK).standard_normal(1000)
    Stream(7, 40, Purpose.TRACK).standard_normal(5)
    assert np.array_equal(first, Stream(7, 41, Purpose.TRACK).standard_normal(1000))


@pytest.mark.parametrize("draw", ["standard_normal", "random"])
def test_seed_frame_purpose_and_draw_give_independent_streams(draw: str) -> None:
    """Changing any of seed, frame and purpose gives numbers without correlation, and so does drawing again."""
    stream = Stream(7, 41, Purpose.TRACK)
    base = getattr(stream, draw)(20_000)
    others = [
        getattr(stream, draw)(20_000),
        *(
            getattr(Stream(seed, frame, purpose), draw)(20_000)
            for seed, frame, purpose in (
                (8, 41, Purpose.TRACK),
                (7 + 2**40, 41, Purpose.TRACK),
                (7, 42, Purpose.TRACK),
                (7, 41, Purpose.SCENE),
            )
        ),
    ]
    for other in others:
        assert abs(np.corrcoef(base, other)[0, 1]) < 0.03


@pytest.mark.parametrize(("key", "counter", "expected"), KNOWN)
def test_the_cipher_gives_the_known_answers(
    key: tuple[int, int], counter: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    """Philox 4x32-10 agrees with the vectors that its authors publish."""
    words = philox(key[0] + (key[1] << 32), counter[2], counter[3], counter[1], counter[0] + 1)
    assert tuple(int(word) for word in words[:, counter[0]]) == expected


def test_the_cipher_is_the_textbook_one_for_any_key_and_counter() -> None:
    """Ten rounds written out in Python's own integers give the same words."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        low, high, draw, frame = (int(word) for word in rng.integers(2**31, size=4))
        words = philox(low + (high << 32), frame, 2, draw, 3)
        assert tuple(int(word) for word in words[:, 2]) == _textbook((low, high), (2, draw, frame, 2))


def test_normals_are_normal_and_uniforms_uniform() -> None:
    """A million numbers of each pass Kolmogorov and Smirnov's test, and the normals have the right four moments."""
    normals = standard_normals(1, 2, Purpose.TRACK.value, 0, 1_000_000)
    assert stats.kstest(normals, "norm").pvalue > 0.01
    assert stats.kstest(uniforms(1, 2, Purpose.TRACK.value, 1, 1_000_000), "uniform").pvalue > 0.01
    moments = [float((normals**power).mean()) for power in (1, 2, 3, 4)]
    assert moments == pytest.approx([0, 1, 0, 3], abs=0.02)


def test_numbers_of_one_draw_are_independent_of_each_other() -> None:
    """Neighbours, and the four lanes that share a counter, have no correlation in value or in magnitude."""
    normals = standard_normals(5, 0, Purpose.TRACK.value, 0, 400_000)
    for lag in (1, 2, 100_000, 200_000, 300_000):
        for pair in ((normals[:-lag], normals[lag:]), (normals[:-lag] ** 2, normals[lag:] ** 2)):
            assert abs(np.corrcoef(*pair)[0, 1]) < 0.012


@pytest.mark.parametrize("count", [0, 1, 2, 3, 5, 800, 801])
def test_any_number_of_numbers_can_be_drawn(count: int) -> None:
    """A draw has as many numbers as asked for, all finite, the uniform ones within [0, 1)."""
    stream = Stream(3, 3, Purpose.TRACK)
    normals, flat = stream.standard_normal(count), stream.random(count)
    assert normals.shape == flat.shape == (count,)
    assert np.isfinite(normals).all()
    assert ((flat >= 0) & (flat < 1)).all()


def test_a_shape_or_none_is_understood_as_numpy_understands_it() -> None:
    """No size gives one number; a tuple gives an array of that shape."""
    assert isinstance(Stream(0, 0, Purpose.START).random(), float)
    assert Stream(0, 0, Purpose.START).standard_normal((2, 3, 4)).shape == (2, 3, 4)


@pytest.mark.parametrize(("seed", "frame"), [(-1, 0), (LARGEST_KEY + 1, 0), (0, -1), (0, 2**32)])
def test_out_of_range_is_refused(seed: int, frame: int) -> None:
    """A seed or frame out of range is refused with a sentence that names the bound."""
    with pytest.raises(ValueError, match="must be a whole number between"):
        Stream(seed, frame, Purpose.START)


def _textbook(key: tuple[int, int], counter: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    a, b, c, d = counter
    low, high = key
    for _ in range(10):
        first, second = a * 0xD2511F53, c * 0xCD9E8D57
        a, b, c, d = (second >> 32) ^ b ^ low, second % 2**32, (first >> 32) ^ d ^ high, first % 2**32
        low, high = (low + 0x9E3779B9) % 2**32, (high + 0xBB67AE85) % 2**32
    return a, b, c, d
