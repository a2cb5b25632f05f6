"""The matrices of the linear model: for MATLAB, Octave and SciPy (.mat), and as lists (.json)."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import scipy

from flexgui.core.results import DescriptorModel, Outcome
from flexgui.export.folder import dumps
from flexgui.export.model_format import ModelFormat, linear_header
from flexgui.views.table import affine

CONSTANT, NAMES = ("B", "C", "D"), ("states", "inputs", "outputs")
"""Of a model: matrices that no posture changes, and the names along their sides."""


HEADER = b"MATLAB 5.0 MAT-file, written by FlexGUI".ljust(116)
"""Without the date, so that the same model gives the same file."""


class MatFile(ModelFormat):
    """E0, E1, ..., A0, ..., B, C, D with names; version 5, read by MATLAB, Octave and SciPy."""

    kind = "matlab"
    label = "Model for MATLAB (.mat)"
    hint = "Linear matrices over the posture."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        content = mat_content(outcome.model)
        content["limits"] = "\n".join(linear_header(outcome, "the linear model"))
        file = io.BytesIO()
        scipy.io.savemat(file, content, oned_as="column")
        return {"model.mat": HEADER + file.getvalue()[len(HEADER) :]}


class JsonFile(ModelFormat):
    """The matrices term by term, for any program."""

    kind = "json"
    label = "Model (.json)"
    hint = "Linear matrices, for any language."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        model = outcome.model
        content = {
            "E_basis": model.basis,
            "E_terms": model.E_terms,
            "A_basis": model.A_basis,
            "A_terms": model.A_terms,
            **{name: getattr(model, name) for name in (*CONSTANT, *NAMES)},
            "note": note(model),
            "about": linear_header(outcome, "the linear model"),
        }
        return {"model.json": dumps(content).encode()}


def note(model: DescriptorModel) -> str:
    """How to evaluate the model, in statements that MATLAB and Octave take."""
    return (
        "E(kappa) x' = A(kappa) x + B u, y = C x + D u, in SI units. Give the scheduling "
        f"variables numbers, then: {affine('E', model.basis, '*')}; "
        f"{affine('A', model.A_basis, '*')}; sys = dss(A, B, C, D, E);"
    )


def mat_content(model: DescriptorModel) -> dict[str, Any]:
    """Variable -> value."""
    terms: dict[str, Any] = {f"E{k}": term for k, term in enumerate(model.E_terms)}
    terms |= {f"A{k}": term for k, term in enumerate(model.A_terms)}
    terms |= {name: getattr(model, name) for name in CONSTANT}
    terms |= {"E_basis": _texts(model.basis), "A_basis": _texts(model.A_basis)}
    return terms | {name: _texts(getattr(model, name)) for name in NAMES} | {"note": note(model)}


def _texts(names: tuple[str, ...]) -> np.ndarray:
    """A cell array of texts."""
    cells = np.empty(len(names), dtype=object)
    cells[:] = names
    return cells
