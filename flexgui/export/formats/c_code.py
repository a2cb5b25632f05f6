"""C code of the linear model: affine matrices over the posture, and an exact step."""

from __future__ import annotations

import numpy as np

from flexgui.core.results import Outcome
from flexgui.export.expressions import in_c
from flexgui.export.model_format import ModelFormat, linear_header, scheduled
from flexgui.export.template import program

FOLDER = "model_c"


class CCode(ModelFormat):
    """Two C99 files that need only the mathematical library."""

    kind = "c_code"
    label = "Linear C code (.zip)"
    hint = "Affine matrices over the posture and an exact step of fixed cost; C99."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {f"{FOLDER}/{name}": text.encode() for name, text in c_sources(outcome).items()}


def c_sources(outcome: Outcome) -> dict[str, str]:
    """File name -> text of flexmodel.h and flexmodel.c."""
    model = outcome.model
    names = scheduled((*model.basis, *model.A_basis))
    values = {
        "header": linear_header(outcome, "C code of the linear model"),
        "states": model.states,
        "inputs": model.inputs,
        "outputs": model.outputs,
        "scheduled": names,
        "coordinates": sum(f"d{name}" in model.states for name in model.states),
        "E_terms": [_numbers(term) for term in model.E_terms],
        "A_terms": [_numbers(term) for term in model.A_terms],
        "B": _numbers(model.B),
        "C": _numbers(model.C),
        "D": _numbers(model.D),
        "E_basis": [in_c(text, names) for text in model.basis],
        "A_basis": [in_c(text, names) for text in model.A_basis],
    }
    return {name: program(name, **values) for name in ("flexmodel.h", "flexmodel.c")}


def _numbers(matrix: np.ndarray) -> str:
    """All digits, row by row."""
    return ", ".join(repr(float(x)) for x in np.asarray(matrix).ravel())
