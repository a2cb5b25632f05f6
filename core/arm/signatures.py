"""Types of compiled functions and of what they take, and functions compiled at their first call."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, ClassVar

from llvmlite import ir
from llvmlite.binding import set_option

from ..arm.cache import use_cache_folder
from ..compiler import cgutils, intrinsic, njit, types

use_cache_folder()  # before the first function is compiled
# Loops here run over a handful of wide numbers: unrolled eight times they take twice as long to
# compile and no less to run.
set_option("", "-unroll-runtime=false")

vector = types.float64[::1]
matrix = types.float64[:, ::1]
cube = types.float64[:, :, ::1]


def filling(numbers: types.Array, count: int) -> types.FunctionType:
    """A C function of that many arrays, some of which it fills; matrices lie row by row."""
    return types.FunctionType(types.void(*[numbers] * count))


OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
}


class Kernel:
    """A compiled function that Python calls. Importing its module compiles nothing: the first call
    does, or finds it in the cache."""

    waits: ClassVar[dict[str, Callable[[], None]]] = {}
    """By a kernel's name what waits until another process, which compiles it, has put it there."""

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        self._function, self._signature = function, signature

    @property
    def compiled(self) -> Callable[..., Any]:
        """The function itself; to ask for it compiles."""
        name = self._function.__name__
        wait = self.waits.get(name)
        if wait is not None:  # outside of `_compiled`, whose lock all kernels share
            wait()
            self.waits.pop(name, None)
        return self._compiled

    @cached_property
    def _compiled(self) -> Callable[..., Any]:
        return njit(self._signature, **OPTIONS)(self._function)

    def __call__(self, *arguments: Any) -> Any:
        """What the function answers; arrays contiguous and of the signature's types."""
        return self.compiled(*arguments)


def kernel(signature: Any) -> Callable[[Callable[..., Any]], Kernel]:
    """The decorator, with the types of arguments and result as Numba states them."""
    return lambda function: Kernel(function, signature)


def _function_of(kind: Any) -> Any:
    @intrinsic
    def function_at(typingctx, address):  # type: ignore[no-untyped-def]
        """The C function of a fixed type at an address (int64): Numba takes forty microseconds
        to recognise one among the arguments of a call from Python, as long as a whole cost may."""

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            empty = ir.Constant(context.get_value_type(kind), None)
            pointer = builder.inttoptr(args[0], cgutils.voidptr_t)
            return builder.insert_value(empty, pointer, 0)

        return kind(types.int64), emit

    return function_at


_filling_4, _filling_5 = (_function_of(filling(vector, count)) for count in (4, 5))
_wide_2, _wide_3, _wide_4, _wide_5 = (_function_of(filling(matrix, n)) for n in (2, 3, 4, 5))

addresses = types.int64[::1]
"""Of an arm's functions: core.arm.compiled.CompiledArm.addresses, WideArm.addresses."""


@njit(**OPTIONS)
def dynamics_of(arm):  # type: ignore[no-untyped-def]
    """`dynamics` of a CompiledArm, by its addresses."""
    return _filling_5(arm[0])


@njit(**OPTIONS)
def tip_of(arm):  # type: ignore[no-untyped-def]
    """Its `tip`."""
    return _filling_4(arm[1])


@njit(**OPTIONS)
def linear_of(arm):  # type: ignore[no-untyped-def]
    """Its `linear`."""
    return _filling_4(arm[2])


@njit(**OPTIONS)
def wide_dynamics_of(arm):  # type: ignore[no-untyped-def]
    """`dynamics` of a WideArm, by its addresses."""
    return _wide_5(arm[0])


@njit(**OPTIONS)
def wide_tip_of(arm):  # type: ignore[no-untyped-def]
    """Its `tip`."""
    return _wide_4(arm[1])


@njit(**OPTIONS)
def solvers_of(arm, n):  # type: ignore[no-untyped-def]
    """n, its number of coordinates, and its `solvers`."""
    return n, _wide_2(arm[2]), _wide_2(arm[3]), _wide_2(arm[4]), _wide_3(arm[5]), _wide_3(arm[6])
