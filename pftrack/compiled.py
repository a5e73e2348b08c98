"""How hot loops are compiled: serially, without the interpreter's lock, and once per machine.

Serial because the loops are microseconds long, where starting threads costs more than the work; cached on disk so that
only the first start pays for compilation.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled"]

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function of arrays and numbers."""
    return cast("Callable[Arguments, Result]", numba.njit(cache=True, nogil=True, error_model="numpy")(function))
