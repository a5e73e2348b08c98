"""Sums whose order is part of their definition, vectorised all the same.

A sum of floating-point numbers depends on its order. A compiler that must keep the order of a loop adds one number
after the other, four times slower than it could; one that may choose chooses by the processor. These two say the order
themselves: the terms are dealt out to sixteen lanes in turn, each lane adds its own from the first to the last, the
lanes are added in halves (the first eight to the last eight, then four to four, and so on), and what is left over at
the end, fewer than sixteen terms, is added up one after the other and comes last. Sixteen lanes are four vectors of
AVX2, which keep its adders busy.

They are for use inside compiled loops only, on arrays that lie together in memory.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

__all__ = ["LANES", "inner_product", "total"]

LANES = 16

Numbers: TypeAlias = NDArray[np.float64] | NDArray[np.float32]


def _type_product(typing_context: Any, first: Any, second: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numba's types
    del typing_context
    return first.dtype(first, second), _generate


def _type_total(typing_context: Any, values: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numba's types
    del typing_context
    return values.dtype(values), _generate


def _generate(context: Any, builder: Any, signature: Any, arguments: Sequence[Any]) -> Any:  # noqa: ANN401 - numba's
    """Write the sum of the products of one or two arrays in LLVM's language."""
    arrays = [
        context.make_array(kind)(context, builder, value) for kind, value in zip(signature.args, arguments, strict=True)
    ]
    number = context.get_data_type(signature.return_type)
    lanes = ir.VectorType(number, LANES)
    size = arrays[0].nitems
    whole = builder.and_(size, ir.Constant(size.type, -LANES))

    def add_terms(kind: Any, begin: Any, end: Any, step: int) -> Any:  # noqa: ANN401 - values of LLVM
        """Add up terms of a kind, one number or sixteen, from begin to end."""
        zero = [0.0] * LANES if kind is lanes else 0.0
        place = cgutils.alloca_once_value(builder, ir.Constant(kind, zero))  # type: ignore[no-untyped-call] # numba has none
        with cgutils.for_range_slice(builder, begin, end, ir.Constant(size.type, step)) as (index, _):
            term = None
            for array in arrays:
                address = builder.bitcast(builder.gep(array.data, [index]), kind.as_pointer())
                factor = builder.load(address, align=context.get_abi_sizeof(number))
                term = factor if term is None else builder.fmul(term, factor)
            builder.store(builder.fadd(builder.load(place), term), place)
        return builder.load(place)

    sums = add_terms(lanes, ir.Constant(size.type, 0), whole, LANES)
    half = LANES
    while half > 1:
        half //= 2
        low, high = (
            builder.shuffle_vector(sums, ir.Constant(sums.type, ir.Undefined), _indices(begin, half))
            for begin in (0, half)
        )
        sums = builder.fadd(low, high)
    rest = add_terms(number, whole, size, 1)
    return builder.fadd(builder.extract_element(sums, ir.Constant(ir.IntType(32), 0)), rest)


def _indices(begin: int, count: int) -> Any:  # noqa: ANN401 - a value of LLVM
    return ir.Constant(ir.VectorType(ir.IntType(32), count), list(range(begin, begin + count)))


inner_product = cast("Callable[[Numbers, Numbers], float]", intrinsic(_type_product))
"""sum_n a_n b_n of arrays (n,) of the same type and size."""

total = cast("Callable[[Numbers], float]", intrinsic(_type_total))
"""sum_n a_n of an array (n,)."""
