"""A small square matrix times a vector: all rows side by side, column by column.

Written in the terms of the machine, as loops over rows and columns are compiled into a
chain of sums that wait for each other, at three times the time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from tactile_lab.arrays import FloatArray

DOUBLE, INDEX = ir.DoubleType(), ir.IntType(32)
WIDTH = 4
FOUR = ir.VectorType(DOUBLE, WIDTH)
NOTHING = ir.Constant(FOUR, ir.Undefined)
ALL_FIRST = ir.Constant(ir.VectorType(INDEX, WIDTH), [0] * WIDTH)


def product_of(size: int) -> Callable[[FloatArray, FloatArray, FloatArray], None]:
    """A function for compiled code: (columns, values, result), all C-contiguous.

    Args:
        size: of the matrix, given by its columns, shape (size, size); of values and
            result, of which no more is read and written.
    """
    whole = size - size % WIDTH

    @intrinsic
    def times(_: Any, columns: Any, values: Any, result: Any) -> Any:
        def build(context: Any, code: Any, signature: Any, arrays: Any) -> Any:
            of, by, into = (
                context.make_array(kind)(context, code, array).data
                for kind, array in zip(signature.args, arrays, strict=True)
            )

            def four(start: Any, at: int) -> Any:
                return code.bitcast(code.gep(start, [INDEX(at)]), FOUR.as_pointer())

            sums: dict[int, Any] = {}
            for i in range(size):
                value = code.load(code.gep(by, [INDEX(i)]))
                wide = code.insert_element(NOTHING, value, INDEX(0))
                wide = code.shuffle_vector(wide, NOTHING, ALL_FIRST)
                for n in (*range(0, whole, WIDTH), *range(whole, size)):
                    at = size * i + n
                    if n < whole:
                        term = code.load(four(of, at), align=8)
                        term = code.fmul(term, wide)
                    else:
                        term = code.load(code.gep(of, [INDEX(at)]))
                        term = code.fmul(term, value)
                    if i:
                        term = code.fadd(sums[n], term)
                    sums[n] = term
            for n, total in sums.items():
                if n < whole:
                    code.store(total, four(into, n), align=8)
                else:
                    code.store(total, code.gep(into, [INDEX(n)]))
            return context.get_dummy_value()

        return types.void(columns, values, result), build

    return cast(Callable[[FloatArray, FloatArray, FloatArray], None], times)
