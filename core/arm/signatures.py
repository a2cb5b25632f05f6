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


dynamics_at = _function_of(filling(vector, 5))
tip_at = _function_of(filling(vector, 4))
linear_at = _function_of(filling(vector, 4))
"""Of `core.arm.compiled.CompiledArm.addresses`, in this order."""

wide_dynamics_at = _function_of(filling(matrix, 5))
wide_tip_at = _function_of(filling(matrix, 4))
solver_at = _function_of(filling(matrix, 2))
product_at = _function_of(filling(matrix, 3))
"""Of `core.arm.compiled.WideArm.addresses`: after dynamics and tip, three solvers, two products."""

addresses = types.int64[::1]
