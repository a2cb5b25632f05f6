"""Types of the compiled functions that are passed to other compiled functions."""

from typing import Any

from numba import types

from core.arm.cache import keep_kernels_here

keep_kernels_here()  # before the first function is compiled

vector = types.float64[::1]
matrix = types.float64[:, ::1]

DYNAMICS = types.FunctionType(types.void(vector, vector, vector, matrix, vector))
TIP = types.FunctionType(types.void(vector, vector, vector, matrix))
LINEAR = types.FunctionType(types.void(vector, vector, matrix, matrix))

OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
}
