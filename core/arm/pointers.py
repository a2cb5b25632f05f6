"""An arm's compiled functions handed over as addresses.

Numba takes ten microseconds to recognise a C function among the arguments of a call from Python,
as long as a whole cost may take; an address is a whole number.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from core.arm.signatures import DYNAMICS, LINEAR


def _function_of(kind: Any) -> Any:
    @intrinsic
    def function_at(typingctx, address):  # type: ignore[no-untyped-def]
        """The C function of a fixed type at an address (int64)."""

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            empty = ir.Constant(context.get_value_type(kind), None)
            pointer = builder.inttoptr(args[0], cgutils.voidptr_t)
            return builder.insert_value(empty, pointer, 0)

        return kind(types.int64), emit

    return function_at


dynamics_at = _function_of(DYNAMICS)
linear_at = _function_of(LINEAR)
