"""Names of array types; docstrings give the shapes."""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]


def spans(flags: Sequence[bool] | Bools) -> list[tuple[int, int]]:
    """Return the first and the last index of each stretch of true flags (L,), in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(flags, np.bool_), [False]])))
    return [(first, end - 1) for first, end in edges.reshape(-1, 2).tolist()]


# Checks at the public functions of the library: compiled code receives only arrays of the right shape.
#
# Compiled loops do not check bounds, so they would read an array of another shape beyond its end. Every public function
# that the interpreter calls states the expected sides, "N d"; the error names the expected and the given sides.
# Functions of compiled loops, which cannot format numbers, compare sizes themselves.


def check(*, missing: bool = False, **arrays: tuple[Any, str] | tuple[Any, str, Literal["whole"]]) -> Mapping[str, int]:
    """Refuse arrays whose sides do not agree, and return the sizes of the sides.

    Args:
        missing: Whether numbers may be NaN or infinite.
        arrays: By name, each with its sides: letters, which must agree between arrays, or numbers, as in "F 3"; and
            with "whole" if it holds whole numbers.

    Raises:
        TypeError: An argument is not an array of real or whole numbers.
        ValueError: One has other sides, is empty, or holds NaN or infinity.
    """
    found = [
        (name, type(it[0]), getattr(it[0], "shape", None), getattr(it[0], "dtype", None), it[1:])
        for name, it in arrays.items()
    ]
    sizes = _sizes(tuple(found))
    for name, (array, *_) in arrays.items():
        # NaN and infinity remain in a sum of squares, a third of the work; it may overflow, too.
        checked = missing or array.dtype.kind != "f" or math.isfinite(np.vdot(array, array))
        if not (checked or np.isfinite(array).all()):
            raise ValueError(f"{name} must be finite, got NaN or infinity")
    return sizes


@lru_cache(maxsize=4096)
def _sizes(arrays: tuple[tuple[str, type, Any, Any, tuple[str, ...]], ...]) -> Mapping[str, int]:
    """Return the sizes of the sides of arrays, each with its name, class, shape, kind of numbers and sides.

    Steps repeat the same check in each frame, so successful checks are cached.
    """
    sizes: dict[str, int] = {}
    for name, kind, shape, numbers, (sides, *whole) in arrays:
        axes = sides.split()
        if not issubclass(kind, np.ndarray) or numbers.kind not in ("iu" if whole else "fiu"):
            got = f"an array of {numbers}" if issubclass(kind, np.ndarray) else kind.__name__
            wanted = "whole" if whole else "real"
            raise TypeError(f"{name} must be an array ({', '.join(axes)}) of {wanted} numbers, got {got}")
        fits = len(shape) == len(axes)
        for axis, size in zip(axes, shape, strict=False):
            fits = fits and size == (int(axis) if axis.isdecimal() else sizes.setdefault(axis, size))
        if not fits:
            known = " and ".join(f"{axis} = {sizes[axis]}" for axis in dict.fromkeys(axes) if axis in sizes)
            where = f" with {known}" if known and len(shape) == len(axes) else ""
            raise ValueError(f"{name} must be ({', '.join(axes)}){where}, got {shape}")
        if 0 in shape:
            raise ValueError(f"{name} must not be empty, got shape {shape}")
    return sizes


def check_picture(picture: object, sides: str = "height width 3") -> None:
    """Refuse what is not a picture of bytes.

    Raises:
        TypeError: It is not an array of bytes.
        ValueError: It has other sides.
    """
    if not isinstance(picture, np.ndarray) or picture.dtype != np.uint8:
        got = f"an array of {picture.dtype}" if isinstance(picture, np.ndarray) else type(picture).__name__
        raise TypeError(f"the picture must be an array ({', '.join(sides.split())}) of uint8, got {got}")
    check(picture=(picture, sides))


def check_count(name: str, count: object, least: int = 1) -> None:
    """Refuse what is not a whole number from `least` on.

    Raises:
        TypeError: It is not a whole number.
        ValueError: It is below.
    """
    if not isinstance(count, int | np.integer) or isinstance(count, bool):
        raise TypeError(f"{name} must be a whole number, got {type(count).__name__}")
    if count < least:
        raise ValueError(f"{name} must be at least {least}, got {count}")
