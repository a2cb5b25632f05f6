"""C code of the non-linear model: its rates, its outputs, and a step for stiff drives."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from flexgui.core.results import Outcome, Quantity
from flexgui.export.expressions import c_statements
from flexgui.export.model_format import ModelFormat, no_equations, plain, whole_header
from flexgui.export.template import program

FOLDER = "arm_c"


class ArmC(ModelFormat):
    """Two C99 files that need only the mathematical library."""

    kind = "arm_c"
    label = "Model in C (.zip)"
    hint = "The non-linear model with drive and forces, and a step function; C99."

    def unable(self, outcome: Outcome) -> str:
        return no_equations(outcome)

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {f"{FOLDER}/{name}": text.encode() for name, text in arm_sources(outcome).items()}


def arm_sources(outcome: Outcome) -> dict[str, str]:
    """File name -> text of flexarm.h and flexarm.c; of an outcome that has state equations."""
    model = outcome.state_equations
    assert model is not None
    values = {
        "header": whole_header(outcome, "C code of the non-linear model"),
        "coordinates": model.coordinates,
        "states": _described(model.states),
        "inputs": _described(model.inputs),
        "outputs": _described(model.outputs),
        "parameters": _described(model.parameters),
        "found": ", ".join(repr(k.value) for k in model.parameters) or "0.0",
        "rates": c_statements(model.needed("rates")),
        "outputs_of": c_statements(model.needed("y")),
    }
    return {name: program(name, **values) for name in ("flexarm.h", "flexarm.c")}


def _described(quantities: Iterable[Quantity]) -> list[Mapping[str, str]]:
    """Texts that stand in comments and in names of constants."""
    return [
        {
            "name": re.sub(r"\W", "_", each.name),
            "unit": plain(each.unit),
            "title": plain(each.title),
            "value": repr(each.value),
        }
        for each in quantities
    ]
