"""The bounded cache of pictures."""

from hypothesis import given
from hypothesis import strategies as st

from pftrack.sources.sequence import BoundedCache


def test_the_least_recently_used_goes_first() -> None:
    """Without room left, what was not asked for longest is let go; a value larger than the cache is kept alone.

    One picture is always kept, or a cache too small would decode each picture twice.
    """
    cache: BoundedCache[str] = BoundedCache(30)
    for number, value in enumerate("abc"):
        cache.put(number, value, 10)
    assert cache.get(0) == "a"
    cache.put(3, "d", 10)
    assert [number in cache for number in range(4)] == [True, False, True, True]
    cache.put(1, "b", 50)
    assert (cache.get(1), len(cache)) == ("b", 1)


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(1, 12)), max_size=40))
def test_it_never_holds_more_than_it_may(puts: list[tuple[int, int]]) -> None:
    """Whatever is put in, the bytes held are counted right and stay within the capacity, but for a single value."""
    cache: BoundedCache[int] = BoundedCache(30)
    for number, size in puts:
        cache.put(number, size, size)
        held = [value for value in (cache.get(each) for each in range(10)) if value is not None]
        assert cache.used_bytes == sum(held) <= 30
    cache.clear()
    assert cache.used_bytes == len(cache) == 0
