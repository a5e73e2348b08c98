"""How hot loops are compiled: serially, without the interpreter's lock, and once per machine.

Serial because the loops are microseconds long, where starting threads costs more than the work; cached on disk so that
only the first start pays for compilation.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled", "compiled_sums"]

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function of arrays and numbers."""
    return cast("Callable[Arguments, Result]", numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def compiled_sums(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function whose sums may be taken in another order, which lets them be vectorised.

    The order is fixed when the function is compiled, so one machine always comes to the same result.
    """
    decorate = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"})
    return cast("Callable[Arguments, Result]", decorate(function))
