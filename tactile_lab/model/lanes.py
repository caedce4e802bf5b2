"""Four numbers side by side for compiled code: one instruction does for all of them.

Written in the terms of the machine, as numba spends one instruction on each number of
what is no loop over an array. They are added, subtracted and multiplied like numbers; a
product is not rounded before it is added to something, where the machine can do so.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import intrinsic, lower_builtin, models, register_model

from tactile_lab.arrays import FloatArray
from tactile_lab.model.matrix import FOUR, INDEX, NOTHING, WIDTH
from tactile_lab.model.scratch import ALIGNED

Lanes = Any
"""Four numbers, in compiled code alone."""


class _Lanes(types.Type):
    """Their type for numba."""


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, FOUR)  # type: ignore[no-untyped-call]


_LANES = _Lanes("Lanes")


def _define(function: Any, instruction: str) -> None:
    """Give an operator between lanes its type and its instruction."""

    @infer_global(function)  # type: ignore[no-untyped-call]
    class _Typed(AbstractTemplate):
        def generic(self, given: Any, _: Any) -> Any:
            return _LANES(*given) if given == (_LANES, _LANES) else None

    @lower_builtin(function, _Lanes, _Lanes)  # type: ignore[no-untyped-call,untyped-decorator]
    def build(_: Any, code: Any, _signature: Any, given: Any) -> Any:
        return getattr(code, instruction)(*given, flags=("contract",))


_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")


def _four(context: Any, code: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, code, array).data
    return code.bitcast(code.gep(data, [at]), FOUR.as_pointer())


def _all(code: Any, lanes: Any, n: int) -> Any:
    which = ir.Constant(ir.VectorType(INDEX, WIDTH), [n] * WIDTH)
    return code.shuffle_vector(lanes, NOTHING, which)


@intrinsic
def _load(_: Any, array: Any, at: Any) -> Any:
    def build(context: Any, code: Any, signature: Any, given: Any) -> Any:
        return code.load(_four(context, code, signature.args[0], *given), align=ALIGNED)

    return _LANES(array, types.intp), build


@intrinsic
def _store(_: Any, array: Any, at: Any, lanes: Any) -> Any:
    def build(context: Any, code: Any, signature: Any, given: Any) -> Any:
        where = _four(context, code, signature.args[0], given[0], given[1])
        code.store(given[2], where, align=ALIGNED)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), build


@intrinsic
def _side_by_side(_: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    def build(_: Any, code: Any, _signature: Any, given: Any) -> Any:
        lanes = NOTHING
        for n, value in enumerate(given):
            lanes = code.insert_element(lanes, value, INDEX(n))
        return lanes

    return _LANES(*[types.float64] * WIDTH), build


@intrinsic
def _apart(_: Any, lanes: Any) -> Any:
    kind = types.UniTuple(types.float64, WIDTH)  # type: ignore[no-untyped-call]

    def build(context: Any, code: Any, _: Any, given: Any) -> Any:
        parts = [code.extract_element(given[0], INDEX(n)) for n in range(WIDTH)]
        return context.make_tuple(code, kind, parts)

    return kind(lanes), build


@intrinsic
def _same(_: Any, x: Any) -> Any:
    def build(_: Any, code: Any, _signature: Any, given: Any) -> Any:
        return _all(code, code.insert_element(NOTHING, given[0], INDEX(0)), 0)

    return _LANES(types.float64), build


@intrinsic(prefer_literal=True)
def _spread(_: Any, lanes: Any, n: Any) -> Any:
    def build(_: Any, code: Any, signature: Any, given: Any) -> Any:
        return _all(code, given[0], signature.args[1].literal_value)

    return _LANES(lanes, n), build


@intrinsic
def _negative(_: Any, lanes: Any) -> Any:
    def build(_: Any, code: Any, _signature: Any, given: Any) -> Any:
        zero = ir.Constant(FOUR, [0.0] * WIDTH)
        return code.select(code.fcmp_ordered("<", given[0], zero), given[0], zero)

    return _LANES(lanes), build


load = cast(Callable[[FloatArray, int], Lanes], _load)
"""The four numbers of an array from the index on, a multiple of 4."""
store = cast(Callable[[FloatArray, int, Lanes], None], _store)
"""Put four numbers into an array, as `load` reads them."""
side_by_side = cast(Callable[[float, float, float, float], Lanes], _side_by_side)
"""Four numbers as lanes."""
apart = cast(Callable[[Lanes], tuple[float, float, float, float]], _apart)
"""Lanes as four numbers."""
same = cast(Callable[[float], Lanes], _same)
"""A number in all lanes."""
spread = cast(Callable[[Lanes, int], Lanes], _spread)
"""What is in one lane, in all of them."""
negative = cast(Callable[[Lanes], Lanes], _negative)
"""What is below 0, and 0 in the place of the rest."""
