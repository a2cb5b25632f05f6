"""The descriptor model as plain lists (.json)."""

from __future__ import annotations

from typing import Any

from flexgui.core.results import DescriptorModel, Outcome
from flexgui.export.folder import dumps
from flexgui.export.formats.matlab import note
from flexgui.export.model_format import ModelFormat, linear_header


class JsonFile(ModelFormat):
    """The matrices term by term, for any program."""

    kind = "json"
    label = "Model (.json)"

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        header = {"about": linear_header(outcome, "the linear model")}
        return {"model.json": dumps(as_json(outcome.model) | header).encode()}


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
