import numpy as np
import pytest

from pftrack.random import MAXIMUM_SEED, Purpose, generator


def test_same_key_same_numbers() -> None:
    """Numbers depend on seed, frame and purpose alone."""
    first = generator(7, 41, Purpose.TRACK).standard_normal(1000)
    generator(7, 40, Purpose.TRACK).standard_normal(5)
    assert np.array_equal(first, generator(7, 41, Purpose.TRACK).standard_normal(1000))


def test_streams_are_unrelated() -> None:
    """Another seed, frame or purpose gives uncorrelated numbers."""
    base = generator(7, 41, Purpose.TRACK).standard_normal(20_000)
    for other in (generator(8, 41, Purpose.TRACK), generator(7, 42, Purpose.TRACK), generator(7, 41, Purpose.SCENE)):
        assert abs(np.corrcoef(base, other.standard_normal(20_000))[0, 1]) < 0.03


def test_frames_do_not_overlap() -> None:
    """A long stream of one frame shares no value with that of the next."""
    first = generator(0, 0, Purpose.TRACK).integers(2**63, size=100_000)
    second = generator(0, 1, Purpose.TRACK).integers(2**63, size=100_000)
    assert not np.intersect1d(first, second).size


@pytest.mark.parametrize(("seed", "frame"), [(-1, 0), (MAXIMUM_SEED + 1, 0), (0, -1)])
def test_range_is_checked(seed: int, frame: int) -> None:
    """A seed or a frame out of range is refused with a sentence that names it."""
    with pytest.raises(ValueError, match=str(seed if frame == 0 else frame)):
        generator(seed, frame, Purpose.START)


def test_key_and_counter_are_those_documented() -> None:
    """The generator is NumPy's Philox with the key (seed, purpose) and the frame in the third word of the counter."""
    key, counter = np.array([7, Purpose.SCENE], dtype=np.uint64), np.array([0, 0, 41, 0], dtype=np.uint64)
    expected = np.random.Generator(np.random.Philox(key=key, counter=counter)).random(100)
    assert np.array_equal(generator(7, 41, Purpose.SCENE).random(100), expected)
