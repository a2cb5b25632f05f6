"""Single calls into an arm's compiled functions, for use from Python."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.arm.signatures import DYNAMICS, LINEAR, OPTIONS, TIP, matrix, vector


@njit(types.Tuple((matrix, vector))(DYNAMICS, vector, vector, vector), **OPTIONS)
def call_dynamics(function, q, v, p):  # type: ignore[no-untyped-def]
    """M (n, n) and F (n,)."""
    M = np.empty((q.size, q.size))
    f = np.empty(q.size)
    function(q, v, p, M, f)
    return M, f


@njit(types.Tuple((vector, matrix))(TIP, vector, vector), **OPTIONS)
def call_tip(function, q, p):  # type: ignore[no-untyped-def]
    """z (2,) and dz/dq (2, n)."""
    z = np.empty(2)
    J = np.empty((2, q.size))
    function(q, p, z, J)
    return z, J


@njit(types.Tuple((matrix, matrix))(LINEAR, vector, vector), **OPTIONS)
def call_linear(function, q, p):  # type: ignore[no-untyped-def]
    """K and D (n, n)."""
    K = np.empty((q.size, q.size))
    D = np.empty((q.size, q.size))
    function(q, p, K, D)
    return K, D
