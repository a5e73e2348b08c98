"""Compilation of hot loops: serial, without the interpreter's lock, and once per machine.

The loops are serial because they take microseconds, so starting threads would cost more than the work; they are cached
on disk so that only the first start pays for compilation.

Every operation is executed as written: none is reordered or fused, since compiled code determines a run's numbers. A
sum is therefore not vectorised automatically; `pftrack.core.numerics.matrices` has vectorised sums whose order is part
of their definition. `pftrack.core.numerics.machine` sets the target processor.

A compiled function contains the functions that it calls, also from other files, but Numba's cache checks only its own
file. So a cached function is marked with a hash of all files that it depends on, and a function with another mark is
compiled again, with its callers and no others.

A mark does not depend on where the files lie, and the processor is the same everywhere, so compiled code fits all
machines with the same Python, Numba and llvmlite. A release contains it in the folder `machine.PRECOMPILED`, which is
read first and never written; functions that do not fit are compiled here and cached.
"""

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

import llvmlite
import numba
import numpy as np
from numba.core.caching import IndexDataCacheFile
from numpy.typing import NDArray

from pftrack.core.numerics.machine import PACKAGE, PRECOMPILED

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Scalar = TypeVar("Scalar", bound=np.generic)

FUNCTIONS: list[Any] = []
"""Results of `compiled` in imported modules."""


class _CacheFile(IndexDataCacheFile):
    """Cached code of one function, after the code from the package."""

    def __init__(self, folder: str, name: str, mark: bytes, precompiled: Path | None) -> None:
        super().__init__(folder, name, mark)  # type: ignore[no-untyped-call]
        # The version is compared first: an index of other code may name types that exist no more, and cannot be read.
        self._version = f"{numba.__version__} {llvmlite.__version__} {mark.hex()}"
        self.precompiled = None if precompiled is None else _CacheFile(str(precompiled), name, mark, None)

    def load(self, key: object) -> object:
        """Return what is kept under a key, a signature among other things; None without either."""
        found = None
        if self.precompiled is not None:
            with suppress(OSError, EOFError, pickle.UnpicklingError):  # it is damaged
                found = self.precompiled.load(key)
        return super().load(key) if found is None else found  # type: ignore[no-untyped-call]

    @property
    def is_precompiled(self) -> bool:
        """Whether code that fits this source, Python, Numba and llvmlite came with the package."""
        return self.precompiled is not None and bool(self.precompiled._load_index())  # type: ignore[no-untyped-call] # noqa: SLF001


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function of arrays and numbers."""
    # No wrapper for C: no function is handed over as a value, and the wrappers take a twentieth of compiling.
    compiler = partial(numba.njit, nogil=True, error_model="numpy", no_cfunc_wrapper=True)
    try:
        dispatcher = compiler(cache=True)(function)
    except RuntimeError:  # no folder can be written, so each process compiles it
        dispatcher = compiler()(function)
    # Numba has no public way to declare what a function depends on; this cache is as strict as Numba's own.
    with suppress(AttributeError):
        cache = dispatcher._cache  # type: ignore[attr-defined] # noqa: SLF001
        cache._cache_file = _CacheFile(  # noqa: SLF001
            cache.cache_path,
            cache._impl.filename_base,  # noqa: SLF001
            mark_of(function),
            precompiled_folder(Path(function.__code__.co_filename)) if PRECOMPILED.exists() else None,
        )
    with suppress(AttributeError):  # the interpreter calls this for arguments of new types
        dispatcher._compile_for_args = partial(  # type: ignore[attr-defined] # noqa: SLF001
            _compile_checked,
            dispatcher._compile_for_args,  # type: ignore[attr-defined] # noqa: SLF001
            function.__name__,
        )
    FUNCTIONS.append(dispatcher)
    return cast("Callable[Arguments, Result]", dispatcher)


def _compile_checked(compile_for: Callable[..., object], name: str, *given: Any) -> object:  # noqa: ANN401
    """Compile a function for arguments of types that were not seen yet.

    Raises:
        TypeError: An argument is a list, or the function takes no arguments of these types.
    """
    got = ", ".join(f"{it.ndim}-D {it.dtype}" if isinstance(it, np.ndarray) else type(it).__name__ for it in given)
    if any(isinstance(it, list) for it in given):  # which Numba would copy item by item
        raise TypeError(f"{name} takes arrays and numbers, got {got}; turn lists into arrays")
    try:
        return compile_for(*given)
    except numba.TypingError as error:
        raise TypeError(f"{name} takes arrays and numbers of other types or dimensions, got {got}") from error


def count_precompiled() -> int:
    """Return the number of functions in imported modules whose compiled code came with the package."""
    kept = [getattr(function._cache, "_cache_file", None) for function in FUNCTIONS]  # noqa: SLF001
    return sum(isinstance(file, _CacheFile) and file.is_precompiled for file in kept)


def precompiled_folder(source: Path) -> Path | None:
    """Return where a release brings what is compiled of a source file; None for files outside the package."""
    return PRECOMPILED / source.relative_to(PACKAGE).parent if source.is_relative_to(PACKAGE) else None


def mark_of(function: Callable[..., object]) -> bytes:
    """Return a hash of the files of a function and of all compiled functions that it can call."""
    files = _files_of(function, set()) if isinstance(function, FunctionType) else set()
    return hashlib.sha256(b"".join(sorted(_content(path) for path in files))).digest()


def _files_of(function: FunctionType, known: set[str]) -> set[str]:
    """Return the files of a function and of its callees, in addition to the known ones."""
    path = function.__code__.co_filename
    if path not in known:
        known.add(path)
        for value in function.__globals__.values():
            # Result of numba.njit and numba.extending.intrinsic.
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
    """Return a read-only view; functions of pictures are compiled only for read-only arrays."""
    view = array.view()
    view.flags.writeable = False
    return view
