import numpy as np
import pytest

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import LANES, inner_product, total


@compiled
def both(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    return inner_product(first, second), total(first)


def in_order(terms: np.ndarray) -> float:
    """The sum as the module's docstring has it, one addition after the other."""
    whole = len(terms) // LANES * LANES
    lanes = np.zeros(LANES, terms.dtype)
    for row in terms[:whole].reshape(-1, LANES):
        lanes = lanes + row
    while len(lanes) > 1:
        lanes = lanes[: len(lanes) // 2] + lanes[len(lanes) // 2 :]
    rest = terms.dtype.type(0)
    for term in terms[whole:]:
        rest = rest + term
    return float(lanes[0] + rest)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 64, 100, 801])
def test_the_order_is_the_one_that_is_defined(count: int, kind: type) -> None:
    """Sums are those of the defined order to the bit, in double and in single precision, of any length."""
    rng = np.random.default_rng(count)
    first, second = (
        rng.normal(size=count).astype(kind) * 10.0 ** rng.integers(-3, 4, count).astype(kind) for _ in "ab"
    )
    first, second = first.astype(kind), second.astype(kind)
    assert both(first, second) == (in_order(first * second), in_order(first))
