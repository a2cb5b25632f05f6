"""Calls into an arm's compiled functions from Python: at one state, or along whole motions."""

from __future__ import annotations

import numpy as np

from ..arm.signatures import DYNAMICS, LINEAR, TIP, cube, kernel, matrix, vector
from ..compiler import types


@kernel(types.Tuple((matrix, vector))(DYNAMICS, vector, vector, vector))
def call_dynamics(function, q, v, p):  # type: ignore[no-untyped-def]
    """M (n, n) and F (n,)."""
    n = q.size
    M, f = np.empty(n * n), np.empty(n)
    function(q, v, p, M, f)
    return M.reshape((n, n)), f


@kernel(types.Tuple((vector, matrix))(TIP, vector, vector))
def call_tip(function, q, p):  # type: ignore[no-untyped-def]
    """z (2,) and dz/dq (2, n)."""
    z, J = np.empty(2), np.empty(2 * q.size)
    function(q, p, z, J)
    return z, J.reshape((2, q.size))


@kernel(types.Tuple((matrix, matrix))(LINEAR, vector, vector))
def call_linear(function, q, p):  # type: ignore[no-untyped-def]
    """K and D (n, n)."""
    n = q.size
    K, D = np.empty(n * n), np.empty(n * n)
    function(q, p, K, D)
    return K.reshape((n, n)), D.reshape((n, n))


@kernel(types.Tuple((matrix, matrix))(TIP, matrix, matrix, vector))
def tip_path(tip, q, v, p):  # type: ignore[no-untyped-def]
    """z and z' (N, 2) along a motion q, v (N, n)."""
    N, n = q.shape
    places, speeds = np.empty((N, 2)), np.zeros((N, 2))
    z, J = np.empty(2), np.empty(2 * n)
    for t in range(N):
        tip(q[t], p, z, J)
        for i in range(2):
            places[t, i] = z[i]
            for j in range(n):
                speeds[t, i] += J[i * n + j] * v[t, j]
    return places, speeds


@kernel(cube(TIP, cube, matrix))
def tip_places(tip, q, p):  # type: ignore[no-untyped-def]
    """z (N, 2, S) along S motions q (N, n, S), each with its own p (S, np)."""
    N, n, S = q.shape
    places = np.empty((N, 2, S))
    z, J, coordinates = np.empty(2), np.empty(2 * n), np.empty(n)
    for t in range(N):
        for s in range(S):
            for i in range(n):
                coordinates[i] = q[t, i, s]
            tip(coordinates, p[s], z, J)
            for i in range(2):
                places[t, i, s] = z[i]
    return places
