"""Memory that compiled code works in and does not count the owners of.

numba counts the owners of each array, by an instruction that all cores wait for, at
each call it is handed to: a third of a solution's time. What lives as long as the
function that made it, or as the call it came by, needs no count.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic

from tactile_lab.arrays import FloatArray

ALIGNED = 32
"""Bytes at a multiple of which it begins."""


def room_for(*shape: int) -> Callable[[], FloatArray]:
    """A function for compiled code: an array of that shape, its content undefined.

    It is on the stack of whichever function calls it and must not be returned.
    """

    @intrinsic
    def room(_: Any) -> Any:
        kind = types.Array(types.float64, len(shape), "C")

        def build(context: Any, code: Any, _signature: Any, _arguments: Any) -> Any:
            with code.goto_entry_block():  # once, not each time a loop comes by
                memory = code.alloca(ir.ArrayType(ir.DoubleType(), math.prod(shape)))
            memory.align = ALIGNED
            steps = [8 * math.prod(shape[n + 1 :]) for n in range(len(shape))]
            made = context.make_array(kind)(context, code)
            made.data = code.bitcast(memory, made.data.type)
            made.nitems = made.nitems.type(math.prod(shape))
            made.itemsize = made.itemsize.type(8)
            made.shape, made.strides = made.shape.type(shape), made.strides.type(steps)
            made.meminfo, made.parent = made.meminfo.type(None), made.parent.type(None)
            return made._getvalue()  # noqa: SLF001  as numba does itself

        return kind(), build

    return cast(Callable[[], FloatArray], room)


@intrinsic
def _borrowed(_: Any, array: Any) -> Any:
    def build(context: Any, code: Any, _signature: Any, arrays: Any) -> Any:
        lent = context.make_array(array)(context, code, arrays[0])
        lent.meminfo = lent.meminfo.type(None)
        lent.parent = lent.parent.type(None)
        return lent._getvalue()  # noqa: SLF001  as numba does itself

    return array(array), build


@intrinsic
def _read_only(_: Any, array: Any) -> Any:
    def build(context: Any, code: Any, signature: Any, arrays: Any) -> Any:
        # one owner more
        kind = signature.return_type
        return impl_ret_borrowed(context, code, kind, arrays[0])  # type: ignore[no-untyped-call]

    return array.copy(readonly=True)(array), build


borrowed = cast(Callable[[FloatArray], FloatArray], _borrowed)
"""The same array for compiled code, not counted: its owner must outlive its use."""
read_only = cast(Callable[[FloatArray], FloatArray], _read_only)
"""The same array for compiled code, as those of a `Waveform` or circuit come.

numba compiles a function once for arrays that may be written and once for those that
may not be: 10 s for a solver.
"""
