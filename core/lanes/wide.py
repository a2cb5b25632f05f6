"""A number type of compiled code that holds LANES doubles, one per system.

Arithmetic and comparisons act on all lanes with one instruction (two, where registers are shorter),
so an expression that is written for one system runs for LANES of them. Branches become `select`.
In memory a vector of n such numbers is a float64 array (n, LANES), read by `get`, written by `put`.

All functions here take doubles too, which lie in a float64 array (n,): one text of a function is
compiled for one system and for LANES side by side. A matrix lies row by row in such a vector.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir

from ..compiler import (
    ConcreteTemplate,
    Conversion,
    PrimitiveModel,
    infer_global,
    intrinsic,
    lower_builtin,
    lower_cast,
    register_default,
    signature,
    types,
)

LANES = 8
"""Doubles in a 512-bit register."""

VECTOR = ir.VectorType(ir.DoubleType(), LANES)
MASK = ir.VectorType(ir.IntType(1), LANES)
_FUSE = ("contract",)
"""A product and a sum may become one instruction, as in the rest of the compiled code."""


class _Lanes(types.Type):
    """A value per lane; a variable that holds the same for all lanes first becomes one."""

    def __init__(self, name: str, single: types.Type) -> None:
        super().__init__(name=name)
        self.single = single

    def unify(self, typingctx: Any, other: types.Type) -> types.Type | None:
        return self if other == self.single else None

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        return Conversion.safe if other == self.single else None


class _Wide(_Lanes):
    """LANES doubles."""


class _Mask(_Lanes):
    """LANES truth values."""


wide, mask = _Wide("Wide", types.float64), _Mask("WideMask", types.boolean)


@register_default(_Wide)
class _WideModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


@register_default(_Mask)
class _MaskModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, MASK)


def spread_in(builder: Any, value: Any, kind: Any = VECTOR) -> Any:
    """The same value in all lanes."""
    empty = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(empty, value, ir.Constant(ir.IntType(32), 0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, empty, places)


@lower_cast(types.float64, wide)
def _from_double(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    return spread_in(builder, value)


@lower_cast(types.boolean, mask)
def _from_truth(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    return spread_in(builder, value, MASK)


def _as_wide(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if kind is wide:
        return value
    return spread_in(builder, context.cast(builder, value, kind, types.float64))


def _binary(symbol: Any, emit: Callable[[Any, Any, Any], Any], result: types.Type) -> None:
    """Lets compiled code use an operator on two wide numbers, or one and a double."""
    pairs = [(wide, wide), (wide, types.float64), (types.float64, wide)]

    @infer_global(symbol)
    class _Typing(ConcreteTemplate):
        cases = [signature(result, *pair) for pair in pairs]

    for pair in pairs:

        @lower_builtin(symbol, *pair)
        def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            a, b = (_as_wide(context, builder, k, x) for k, x in zip(sig.args, args, strict=True))
            return emit(builder, a, b)


for _symbol, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):

    def _arithmetic(builder: Any, a: Any, b: Any, name: str = _name) -> Any:
        return getattr(builder, name)(a, b, flags=_FUSE)

    _binary(_symbol, _arithmetic, wide)
    _binary(getattr(operator, f"i{_symbol.__name__}"), _arithmetic, wide)

for _symbol, _sign in (
    (operator.gt, ">"),
    (operator.lt, "<"),
    (operator.ge, ">="),
    (operator.le, "<="),
):

    def _comparison(builder: Any, a: Any, b: Any, sign: str = _sign) -> Any:
        return builder.fcmp_ordered(sign, a, b)

    _binary(_symbol, _comparison, mask)


@infer_global(operator.neg)
class _Negative(ConcreteTemplate):
    cases = [signature(wide, wide)]


@lower_builtin(operator.neg, wide)
def _negate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


@infer_global(operator.pos)
class _Positive(ConcreteTemplate):
    cases = [signature(wide, wide)]


@lower_builtin(operator.pos, wide)
def _keep(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return args[0]


def _masks(symbol: Any, name: str) -> None:
    @infer_global(symbol)
    class _Typing(ConcreteTemplate):
        cases = [signature(mask, mask, mask)]

    @lower_builtin(symbol, mask, mask)
    def _lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)


_masks(operator.and_, "and_")
_masks(operator.or_, "or_")


def _number_in(array: types.Array) -> types.Type:
    """What a row of an array is."""
    return wide if array.ndim == 2 else types.float64


def _of(*kinds: types.Type) -> types.Type:
    """Wide where any of them is."""
    return wide if wide in kinds else types.float64


def _as(kind: types.Type, context: Any, builder: Any, source: types.Type, value: Any) -> Any:
    """The value as a number of that kind."""
    if kind is wide:
        return _as_wide(context, builder, source, value)
    return context.cast(builder, value, source, types.float64)


def row_pointer(context: Any, builder: Any, kind: types.Array, array: Any, row: Any) -> Any:
    """Of one number of a float64 array (n,) or (n, LANES)."""
    data = context.make_array(kind)(context, builder, array).data
    if kind.ndim == 1:
        return builder.gep(data, [row])
    start = builder.mul(row, ir.Constant(row.type, LANES))
    return builder.bitcast(builder.gep(data, [start]), VECTOR.as_pointer())


def _get(typingctx, array, row):  # type: ignore[no-untyped-def]
    """Row `row` of a float64 array (n,) or (n, LANES) as one number."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        place = row_pointer(context, builder, sig.args[0], args[0], args[1])
        return builder.load(place, align=8)

    return _number_in(array)(array, types.intp), emit


def _put(typingctx, array, row, value):  # type: ignore[no-untyped-def]
    """Row `row` of a float64 array (n,) or (n, LANES) becomes `value`."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        whole = _as(_number_in(array), context, builder, sig.args[2], args[2])
        place = row_pointer(context, builder, sig.args[0], args[0], args[1])
        builder.store(whole, place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, _of(value)), emit


def _select(typingctx, where, a, b):  # type: ignore[no-untyped-def]
    """Lane by lane `a` where `where` is true, else `b`."""
    kind = wide if where is mask else _of(a, b)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        a, b = (_as(kind, context, builder, sig.args[i], args[i]) for i in (1, 2))
        return builder.select(args[0], a, b)

    return kind(where, _of(a), _of(b)), emit


def _any_lane(typingctx, where):  # type: ignore[no-untyped-def]
    """Whether any lane is true."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        if where is not mask:
            return args[0]
        bits = builder.bitcast(args[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(where), emit


def _spread_number(typingctx, value):  # type: ignore[no-untyped-def]
    """A double, or a number that is wide already, in all lanes."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return _as_wide(context, builder, sig.args[0], args[0])

    return wide(wide if value is wide else types.float64), emit


def _lane(typingctx, value, at):  # type: ignore[no-untyped-def]
    """The double in one lane."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.extract_element(args[0], args[1])

    return types.float64(wide, types.intp), emit


def _with_lane(typingctx, value, at, number):  # type: ignore[no-untyped-def]
    """The same number with another double in one lane."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.insert_element(args[0], args[2], args[1])

    return wide(wide, types.intp, types.float64), emit


EXPONENT_BIAS, FRACTION_BITS = 1023, 52
"""Of a double (IEEE 754)."""


def _power_of_two(typingctx, exponent):  # type: ignore[no-untyped-def]
    """2 to a whole number from -1022 to 1023."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        whole = ir.VectorType(ir.IntType(64), LANES)
        bias, bits = (ir.Constant(whole, [n] * LANES) for n in (EXPONENT_BIAS, FRACTION_BITS))
        shifted = builder.shl(builder.add(builder.fptosi(args[0], whole), bias), bits)
        return builder.bitcast(shifted, VECTOR)

    return wide(wide), emit


def _elementary(name: str, count: int) -> Any:
    """An LLVM function of `count` numbers, doubles or wide."""

    def typing(typingctx: Any, *values: Any) -> Any:
        result = _of(*values)
        number_type, suffix = (
            (VECTOR, f"v{LANES}f64") if result is wide else (ir.DoubleType(), "f64")
        )

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            pairs = zip(sig.args, args, strict=True)
            numbers = [_as(result, context, builder, k, x) for k, x in pairs]
            full = f"llvm.{name}.{suffix}"
            function = builder.module.globals.get(full)
            if function is None:
                kind = ir.FunctionType(number_type, [number_type] * len(numbers))
                function = ir.Function(builder.module, kind, full)
            return builder.call(function, numbers)

        return result(*[_of(kind) for kind in values]), emit

    def one(typingctx, x):  # type: ignore[no-untyped-def]
        return typing(typingctx, x)

    def two(typingctx, x, y):  # type: ignore[no-untyped-def]
        return typing(typingctx, x, y)

    return intrinsic(one if count == 1 else two)


# Any: the type checker would ask for the typing context that Numba adds by itself.
get: Any = intrinsic(_get)
put: Any = intrinsic(_put)
select: Any = intrinsic(_select)
any_lane: Any = intrinsic(_any_lane)
spread: Any = intrinsic(_spread_number)
lane: Any = intrinsic(_lane)
with_lane: Any = intrinsic(_with_lane)
power_of_two: Any = intrinsic(_power_of_two)
floor: Any = _elementary("floor", 1)
sqrt: Any = _elementary("sqrt", 1)
absolute: Any = _elementary("fabs", 1)
minimum: Any = _elementary("minnum", 2)
maximum: Any = _elementary("maxnum", 2)
