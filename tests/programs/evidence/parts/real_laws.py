"""Own laws on real rigs: the examples of tutorial 3, and what each leaves on unseen recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flexgui.core.results import Outcome
from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.written import estimate_text
from tests.programs.evidence.frame import table
from tests.programs.evidence.parts.real_rigs import FILES as RECORDINGS
from tests.programs.evidence.parts.real_rigs import RIGS, write_scenario

TITLE = "Own laws on real rigs"
ORDER = 4
FILES = RECORDINGS

BOTH = ("viscous_friction", "coulomb_friction")
SLIDE = (*BOTH, "friction_asymmetry")


@dataclass(frozen=True)
class Example:
    """A law, and the model that it is added to."""

    rig: str
    effects: tuple[str, ...]
    """With the law."""
    target: str
    formula: str
    parameters: Mapping[str, tuple[float, str]]
    """Name -> start and unit."""
    instead: tuple[str, ...] = ()
    """Effects that the model without the law has besides."""

    @property
    def toml(self) -> str:
        """The entry of `[[model.own]]`."""
        each = ", ".join(
            f"{name} = {{ start = {start}, unit = {json.dumps(unit, ensure_ascii=False)} }}"
            for name, (start, unit) in self.parameters.items()
        )
        return (
            f'[[model.own]]\ntarget = "{self.target}"\nformula = "{self.formula}"\n'
            f"parameters = {{ {each} }}\n"
        )


PLACES = ", ".join(f"a{k}" for k in range(1, 8))
EXAMPLES = {
    "directions": Example(
        "emps", ("coulomb_friction",), "joint1",
        "-(a*(1 + friction(theta1)) + b*(1 - friction(theta1)))/2*dtheta1",
        {"a": (200.0, "N s/m"), "b": (200.0, "N s/m")}, ("viscous_friction",),
    ),
    "saturation": Example(
        "emps", SLIDE, "joint1", "-a*tanh(dtheta1/s)", {"a": (5.0, "N"), "s": (0.02, "m/s")}
    ),
    "place": Example(
        "emps", SLIDE, "joint1", f"spline(theta1, 0, 0.246, {PLACES})",
        {f"a{k}": (0.1, "N") for k in range(1, 8)},
    ),
    "load": Example(
        "ur10e_joint2", ("viscous_friction", "gravity_tilt"), "joint1",
        "-(a + b*abs(u1))*friction(theta1)", {"a": (10.0, "N m"), "b": (0.1, "")},
        ("coulomb_friction",),
    ),
    "bristle": Example(
        "ur10e_joint1", ("viscous_friction",), "joint1", "-a*hysteresis(theta1, s)",
        {"a": (10.0, "N m"), "s": (1e-3, "rad")}, ("coulomb_friction",),
    ),
    "gauge": Example(
        "flexible_link", ("viscous_friction",), "deflection1", "a*deflection1", {"a": (0.1, "")}
    ),
    "gear": Example(
        "kuka_rigid", BOTH, "joint1", "a*cos(256.857*theta1) + b*sin(256.857*theta1)",
        {"a": (10.0, "N m"), "b": (10.0, "N m")},
    ),
}  # fmt: skip


def judged(name: str, folder: Path) -> dict[str, Any]:
    """Values, and errors without and with the law."""
    example = EXAMPLES[name]
    without = _fitted(example, folder, (*example.effects, *example.instead), "")
    with_law = _fitted(example, folder, example.effects, example.toml)
    values = {e.name: e for e in with_law.fits[0].estimates}
    return {
        "values": [f"{k} = {estimate_text(values[k])}" for k in example.parameters],
        "errors": [_errors(without), _errors(with_law)],
    }


def _fitted(example: Example, folder: Path, effects: tuple[str, ...], own: str) -> Outcome:
    listed = ", ".join(f'{{ id = "{kind}" }}' for kind in effects)
    tables = f'[model]\nlevel = "nonlinear"\neffects = [{listed}]\n\n{own}'
    with TemporaryDirectory() as temporary:
        work = Path(temporary)
        path = write_scenario(example.rig, folder, work, tables)
        return run_scenario(read_scenario(path), folder=work)


def _errors(outcome: Outcome) -> dict[str, float]:
    """Role -> rms of |measured - modelled| / |measured| of the last channel over its recordings."""
    squares: dict[str, list[float]] = {}
    for c in outcome.comparisons:
        squares.setdefault(c.role, []).append(c.channels[-1].relative_error ** 2)
    return {role: (sum(each) / len(each)) ** 0.5 for role, each in squares.items()}


CASES = {name: partial(judged, name) for name in EXAMPLES}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    head = ("rig", "law", "at", "values", "error", "error, unseen")
    rows = [_row(EXAMPLES[name], found[name]) for name in EXAMPLES if name in found]
    return (
        "The examples of tutorial 3, on the rigs of the table before. Error: |measured − modelled| "
        "/ |measured| of the drive's force or torque, of the gauge for a law of its reading, "
        "without the law (with a listed effect in its place) and with it; *unseen*: on recordings, "
        f"or on a last third, that no fit used.\n\n{table(head, rows)}"
    )


def _row(example: Example, one: Mapping[str, Any]) -> list[str]:
    pairs = [
        " → ".join(f"{100.0 * errors[role]:.2f} %" for errors in one["errors"])
        for role in ("estimate", "validate")
    ]
    values = ", ".join(one["values"])
    return [RIGS[example.rig].title, f"`{example.formula}`", example.target, values, *pairs]
