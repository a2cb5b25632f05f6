"""The compiler of kernels, ready before any thread uses it.

Numba makes its target at the first use, under two locks that two threads may take in opposite
order; a page then hung for ever. And its parts may not be imported while another thread is still
importing the whole. So kernels get all that they need of it from here: the whole comes first, and
the locks are taken once, in one order.
"""

from __future__ import annotations

from numba import carray, cfunc, int64, njit, types  # the whole: before its parts
from numba.core import cgutils
from numba.core.compiler_lock import global_compiler_lock
from numba.core.datamodel import PrimitiveModel, register_default
from numba.core.imputils import lower_cast
from numba.core.registry import cpu_target
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

__all__ = [
    "ConcreteTemplate", "Conversion", "PrimitiveModel", "carray", "cfunc", "cgutils",
    "infer_global", "int64", "intrinsic", "lower_builtin", "lower_cast", "njit",
    "register_default", "signature", "types",
]  # fmt: skip

with global_compiler_lock:
    _ = cpu_target.typing_context, cpu_target.target_context
