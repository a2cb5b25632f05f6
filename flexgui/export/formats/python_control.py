"""A script for python-control: the linear model at any posture."""

from __future__ import annotations

import ast

import numpy as np

from flexgui.core.results import DescriptorModel, Outcome
from flexgui.export.model_format import FUNCTIONS, ModelFormat, linear_header, scheduled
from flexgui.export.template import program
from flexgui.views.table import affine

ELBOW = 1.5707963267948966
"""rad, the default of each scheduled joint: an arm that is bent at a right angle."""


class ControlScript(ModelFormat):
    """Runs if python-control is installed."""

    kind = "python_control"
    label = "Model for python-control (.py)"
    hint = "A script: system(theta2) gives a state space; run alone it prints the poles."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {"model_control.py": script(outcome).encode()}


def script(outcome: Outcome) -> str:
    """The script's text."""
    model = outcome.model
    names = scheduled((*model.basis, *model.A_basis))
    return program(
        "model_control.py",
        header="\n".join(linear_header(outcome, "a script for python-control")).replace('"', "'"),
        matrices="\n".join(_matrices(model)),
        states=list(model.states),
        inputs=list(model.inputs),
        outputs=list(model.outputs),
        arguments=", ".join(f"{name}={ELBOW!r}" for name in names),
        E=_checked("E", model.basis),
        A=_checked("A", model.A_basis),
    )


def _matrices(model: DescriptorModel) -> list[str]:
    named = [(f"E{k}", term) for k, term in enumerate(model.E_terms)]
    named += [(f"A{k}", term) for k, term in enumerate(model.A_terms)]
    named += [("B", model.B), ("C", model.C), ("D", model.D)]
    return [f"{name} = np.array({_rows(matrix)})" for name, matrix in named]


def _rows(matrix: np.ndarray) -> str:
    """All digits, one row per line."""
    rows = ",\n".join(f"    {[float(x) for x in row]}" for row in matrix)
    return f"[\n{rows},\n]"


def _checked(name: str, basis: tuple[str, ...]) -> str:
    """The sum; a basis function is written as it is, so it may hold nothing but arithmetic."""
    for function in basis:
        nodes = ast.walk(ast.parse(function, mode="eval"))
        calls = [node.func for node in nodes if isinstance(node, ast.Call)]
        if any(not isinstance(f, ast.Name) or f.id not in FUNCTIONS for f in calls):
            raise ValueError(f"{function!r} is no function of the posture")
    return affine(name, basis, " * ")
