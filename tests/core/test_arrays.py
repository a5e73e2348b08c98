import numpy as np
import pytest

from pftrack.core.arrays import check


@pytest.mark.parametrize("value", [1e200, np.nan, np.inf, -np.inf])
def test_numbers_whose_squares_overflow_are_finite(value: float) -> None:
    """Only NaN and infinity are refused, however an array lies in memory."""
    array = np.zeros((3, 4))
    array[1, 2] = value
    for view in (array, array.T, array[1:, ::2]):
        if np.isfinite(value):
            assert check(values=(view, "n m")) == dict(zip("nm", view.shape, strict=True))
        else:
            with pytest.raises(ValueError, match="values must be finite"):
                check(values=(view, "n m"))
