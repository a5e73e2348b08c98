"""How hot loops are compiled: serially, without the interpreter's lock, and once per machine.

Serial because the loops are microseconds long, where starting threads costs more than the work; cached on disk so that
only the first start pays for compilation.

Every operation is done as it is written: none is reordered or fused, since what is compiled decides about a run's
numbers. A sum is therefore not vectorised by itself; `sums.inner_product` and `sums.total` are vectorised sums whose
order is part of their definition. What processor is compiled for is settled by `pftrack.numerics.machine`.

A compiled function contains those that it calls, also from other files, but Numba's cache looks only at its own file.
So what is kept is marked with the content of all files that a function was made of, and what has another mark is
compiled again: that function and its callers, and no others.
"""

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["FUNCTIONS", "compiled", "mark_of", "read_only"]

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Scalar = TypeVar("Scalar", bound=np.generic)

FUNCTIONS: list[Any] = []
"""What `compiled` has made, in modules that have been imported."""


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function of arrays and numbers."""
    dispatcher = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    # There is no public way to say what a function depends on; a cache of another make is as strict as Numba's own.
    with suppress(AttributeError):
        kept, mark = dispatcher._cache._cache_file, mark_of(function)  # type: ignore[attr-defined] # noqa: SLF001
        kept._source_stamp = mark  # noqa: SLF001
        # The version is compared first: an index of other code may name types that exist no more, and cannot be read.
        kept._version = f"{numba.__version__} {mark.hex()}"  # noqa: SLF001
    FUNCTIONS.append(dispatcher)
    return cast("Callable[Arguments, Result]", dispatcher)


def mark_of(function: Callable[..., object]) -> bytes:
    """Return a hash of the files of a function and of all compiled functions that it can call."""
    files = _files_of(function, set()) if isinstance(function, FunctionType) else set()
    return hashlib.sha256(b"".join(sorted(_content(path) for path in files))).digest()


def _files_of(function: FunctionType, known: set[str]) -> set[str]:
    """Return the files of a function and of what it can call, beside those that are known."""
    path = function.__code__.co_filename
    if path not in known:
        known.add(path)
        for value in function.__globals__.values():
            # What numba.njit and numba.extending.intrinsic make of a function.
            called = getattr(value, "py_func", None) or getattr(value, "_defn", None)
            if isinstance(called, FunctionType):
                _files_of(called, known)
    return known


@cache
def _content(path: str) -> bytes:
    try:
        return hashlib.sha256(Path(path).read_bytes()).digest()
    except OSError:  # typed into a notebook
        return b""


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """Return a view that may not be written: what takes pictures is compiled for such, and only for such."""
    view = array.view()
    view.flags.writeable = False
    return view
