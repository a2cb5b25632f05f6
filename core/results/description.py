"""A model as it is displayed and exported."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Equation:
    """A displayed equation of the model."""

    title: str
    latex: str
    note: str = ""


@dataclass(frozen=True)
class DescriptorModel:
    """E(kappa) x' = A x + B u, y = C x in affine terms, numbers at the estimate.

    `E_terms[i]` belongs to `basis[i]`, a readable function of the scheduling variables such as
    '1' or 'cos(theta2)'; the same for A.
    """

    basis: tuple[str, ...]
    E_terms: np.ndarray
    """(terms, nx, nx)"""
    A_basis: tuple[str, ...]
    A_terms: np.ndarray
    """(terms, nx, nx)"""
    B: np.ndarray
    """(nx, nu)"""
    outputs: tuple[str, ...]
    C: np.ndarray
    """(ny, nx)"""
    D: np.ndarray
    """(ny, nu)"""
    states: tuple[str, ...]
    inputs: tuple[str, ...]
