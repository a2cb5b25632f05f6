"""The descriptor model for MATLAB, Octave or SciPy (.mat) and for everything else (.json)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from core.results import DescriptorModel
from flexgui.views.matrices import factor


def note(model: DescriptorModel) -> str:
    """How to evaluate the model, in statements that MATLAB and Octave take."""
    return (
        "E(kappa) x' = A(kappa) x + B u, y = C x + D u, in SI units. Give the scheduling "
        f"variables numbers, then: {_sum('E', model.basis)} {_sum('A', model.A_basis)} "
        "sys = dss(A, B, C, D, E);"
    )


def _sum(name: str, basis: tuple[str, ...]) -> str:
    return (
        f"{name} = " + " + ".join(factor(f, f"{name}{k}", "*") for k, f in enumerate(basis)) + ";"
    )


def write_mat(model: DescriptorModel, path: Path) -> None:
    """E0, E1, ..., A0, ..., B, C, D with names; version 5, read by MATLAB, Octave and SciPy."""
    terms = {f"E{k}": term for k, term in enumerate(model.E_terms)}
    terms |= {f"A{k}": term for k, term in enumerate(model.A_terms)}
    content = terms | {
        "B": model.B,
        "C": model.C,
        "D": model.D,
        "E_basis": _texts(model.basis),
        "A_basis": _texts(model.A_basis),
        "states": _texts(model.states),
        "inputs": _texts(model.inputs),
        "outputs": _texts(model.outputs),
        "note": note(model),
    }
    savemat(path, content, oned_as="column")


def _texts(names: tuple[str, ...]) -> np.ndarray:
    """A cell array of texts."""
    cells = np.empty(len(names), dtype=object)
    cells[:] = names
    return cells


def as_json(model: DescriptorModel) -> dict[str, Any]:
    """The same as plain lists."""
    return {
        "E_basis": model.basis,
        "E_terms": model.E_terms,
        "A_basis": model.A_basis,
        "A_terms": model.A_terms,
        "B": model.B,
        "C": model.C,
        "D": model.D,
        "states": model.states,
        "inputs": model.inputs,
        "outputs": model.outputs,
        "note": note(model),
    }
