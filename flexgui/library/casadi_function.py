"""The identified model as a function of CasADi, for optimal control and estimation."""

from __future__ import annotations

import ast
import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.core.results.state_equations import StateEquations, parts_of
from flexgui.core.sentences import install_command
from flexgui.export.expressions import COMMON, Language, translated
from flexgui.library.shown import looked_up

if TYPE_CHECKING:
    import casadi


def casadi_function(model: StateEquations, free: Sequence[str] = ()) -> casadi.Function:
    """(x, r) -> (xdot, y), or (x, r, k) with the parameters that stay free.

    Raises:
        InputError: Where CasADi is not installed, or a parameter is not known.
    """
    try:
        import casadi as ca
    except ImportError:
        command = install_command("casadi")
        raise InputError(f"CasADi is not installed; run {command}.") from None
    names = {one.name: i for i, one in enumerate(model.parameters)}
    places = [looked_up(names, name, f"{name!r} cannot be free") for name in free]
    x, r, k = (
        ca.SX.sym(letter, count)
        for letter, count in zip("xrk", (len(model.states), len(model.inputs), len(free)),
                                 strict=True)
    )  # fmt: skip
    known: dict[str, Any] = {f"x[{i}]": x[i] for i in range(x.shape[0])}
    known |= {f"r[{i}]": r[i] for i in range(r.shape[0])}
    known |= {f"k[{i}]": ca.SX(one.value) for i, one in enumerate(model.parameters)}
    known |= {f"k[{place}]": k[i] for i, place in enumerate(places)}
    language = _language()
    for statement in model.statements:
        left, sign, right = parts_of(statement)
        value = translated(right, language, known.__getitem__)
        known[left] = known[left] + value if sign == "+=" else value
    rates = ca.vertcat(*[known[f"rates[{i}]"] for i in range(len(model.states))])
    y = ca.vertcat(*[known[f"y[{i}]"] for i in range(len(model.outputs))])
    inputs, called = ([x, r, k], ["x", "r", "k"]) if free else ([x, r], ["x", "r"])
    return ca.Function("flexarm", inputs, [rates, y], called, ["xdot", "y"], {"cse": True})


def _language() -> Language:
    import casadi as ca

    return Language(
        number=ca.SX,
        functions={name: getattr(ca, name) for name in COMMON}
        | {"abs": ca.fabs, "min": ca.fmin, "max": ca.fmax},
        operators={
            ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
            ast.Div: operator.truediv, ast.Pow: operator.pow, ast.USub: operator.neg,
            ast.Not: ca.logic_not, ast.And: ca.logic_and, ast.Or: ca.logic_or,
            ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
            ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.IfExp: ca.if_else,
        },
    )  # fmt: skip
