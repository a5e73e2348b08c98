"""How hot loops are compiled: serially, without the interpreter's lock, and once per machine.

Serial because the loops are microseconds long, where starting threads costs more than the work; cached on disk so that
only the first start pays for compilation.

A compiled function contains those that it calls, also from other files, but its cache looks only at its own file. So
what was compiled before the newest of these files was written is forgotten at every start.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled", "compiled_sums", "forget_stale"]

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


def forget_stale(package: Path) -> None:
    """Remove the compiled functions of a package that are older than the newest file with a compiled function."""
    caches = [cache for folder in package.rglob("__pycache__") for cache in folder.glob("*.nbi")]
    sources = {cache.parents[1] / f"{cache.name.partition('.')[0]}.py" for cache in caches}
    with suppress(OSError):  # another process is at it, or the folder is not ours to write
        newest = max((source.stat().st_mtime_ns for source in sources if source.exists()), default=0)
        for cache in caches:
            if cache.stat().st_mtime_ns < newest:
                cache.unlink()


forget_stale(Path(__file__).parent)
