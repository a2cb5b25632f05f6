"""Calls into an arm's compiled functions from Python: at one state, or along whole motions."""

from __future__ import annotations

import numpy as np

from ..arm.signatures import addresses, cube, dynamics_of, kernel, linear_of, matrix, tip_of, vector
from ..compiler import types


@kernel(types.Tuple((matrix, vector))(addresses, vector, vector, vector))
def call_dynamics(arm, q, v, p):  # type: ignore[no-untyped-def]
    """M (n, n) and F (n,)."""
    n = q.size
    M, f = np.empty(n * n), np.empty(n)
    dynamics_of(arm)(q, v, p, M, f)
    return M.reshape((n, n)), f


@kernel(types.Tuple((vector, matrix))(addresses, vector, vector))
def call_tip(arm, q, p):  # type: ignore[no-untyped-def]
    """z (2,) and dz/dq (2, n)."""
    z, J = np.empty(2), np.empty(2 * q.size)
    tip_of(arm)(q, p, z, J)
    return z, J.reshape((2, q.size))


@kernel(types.Tuple((cube, cube))(addresses, matrix, matrix))
def call_linear(arm, q, p):  # type: ignore[no-untyped-def]
    """K and D (S, n, n) at S places q (S, n) with p (S, np) each."""
    (S, n), linear = q.shape, linear_of(arm)
    K, D = np.empty((S, n * n)), np.empty((S, n * n))
    for s in range(S):
        linear(q[s], p[s], K[s], D[s])
    return K.reshape((S, n, n)), D.reshape((S, n, n))


@kernel(types.Tuple((matrix, matrix))(addresses, matrix, matrix, vector))
def tip_path(arm, q, v, p):  # type: ignore[no-untyped-def]
    """z and z' (N, 2) along a motion q, v (N, n)."""
    (N, n), tip = q.shape, tip_of(arm)
    places, speeds = np.empty((N, 2)), np.zeros((N, 2))
    z, J = np.empty(2), np.empty(2 * n)
    for t in range(N):
        tip(q[t], p, z, J)
        for i in range(2):
            places[t, i] = z[i]
            for j in range(n):
                speeds[t, i] += J[i * n + j] * v[t, j]
    return places, speeds


@kernel(cube(addresses, cube, matrix))
def tip_places(arm, q, p):  # type: ignore[no-untyped-def]
    """z (N, 2, S) along S motions q (N, n, S), each with its own p (S, np)."""
    (N, n, S), tip = q.shape, tip_of(arm)
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
