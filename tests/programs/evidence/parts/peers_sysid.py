"""`mujoco.sysid` on the independent engine's recordings: one model per candidate, each refitted."""

from __future__ import annotations

import io
import time
import tomllib
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.programs.evidence.frame import table

TITLE = "Peers on equal data: mujoco.sysid"
ORDER = 3
FILES: tuple[str, ...] = ()
NEEDS = ("mujoco", "absl", "colorama", "tabulate")
SOURCES = ("evidence/chain_models.py", "mujoco/chain.py")

FOLDER = Path(__file__).resolve().parents[4] / "scenarios" / "mujoco"
TRUTH = tomllib.loads((FOLDER / "truth.toml").read_text(encoding="utf-8"))
SINGLE = tuple(name for name, effects in TRUTH.items() if len(effects) < 2)
ITERATIONS = 25
"""Most of the optimiser's, three times what a short recording with viscous friction took."""


def refitted(case: str, _: Path) -> dict[str, Any]:
    """candidate -> its χ², parameters in SI with their 95 % intervals, and processor time."""
    from tests.programs.evidence import chain_models

    data = chain_models.recordings(FOLDER / case)
    return {name: _fitted(name, data) for name in chain_models.CANDIDATES}


def _fitted(candidate: str, data: Any) -> dict[str, Any]:
    from mujoco import sysid

    from tests.programs.evidence import chain_models

    knobs = chain_models.knobs(candidate)
    clock = time.process_time()
    parameters = sysid.ParameterDict()
    for name, k in knobs.items():
        parameters.add(sysid.Parameter(name, nominal=k.start, min_value=k.lower, max_value=k.upper))

    def errors(x: np.ndarray, _: Any, **__: Any) -> tuple[list[np.ndarray], list, list]:  # type: ignore[type-arg]
        columns = x.reshape(len(knobs), -1).T
        found = [chain_models.errors(candidate, _in_si(knobs, column), data) for column in columns]
        return [np.array(found).T if x.ndim > 1 else found[0]], [], []

    with redirect_stdout(io.StringIO()):  # its optimiser prints every iteration
        best, end = sysid.optimize(parameters, errors, verbose=False, max_iters=ITERATIONS)
    residual = errors(best.as_vector(), None)[0]
    _, halves = sysid.calculate_intervals(residual, np.asarray(end.jac))
    scales = [k.scale for k in knobs.values()]
    return {
        "chi2": float(residual[0] @ residual[0]),
        "count": len(residual[0]),
        "values": _in_si(knobs, best.as_vector()),
        "intervals": dict(zip(knobs, (halves * scales).tolist(), strict=True)),
        "seconds": time.process_time() - clock,
    }


def _in_si(knobs: Mapping[str, Any], column: np.ndarray) -> dict[str, float]:
    return {name: float(x) * k.scale for (name, k), x in zip(knobs.items(), column, strict=True)}


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    name: partial(refitted, name) for name in SINGLE
}


def named(models: Mapping[str, Mapping[str, Any]]) -> str:
    """The candidate with the least χ² after a fair price (BIC) for its parameters."""
    return min(
        models,
        key=lambda m: models[m]["chi2"] + len(models[m]["values"]) * np.log(models[m]["count"]),
    )


ABOUT = (
    "The program's own recordings of a chain of 20 hinges per link; three postures of 2 s. The "
    "user of `mujoco.sysid` writes a chain of six hinges per link and one model for each of ten "
    "candidates, starts all of them with both stiffnesses 30 % off, and takes the one with the "
    "least χ² after the price of its parameters (BIC). Its optimiser and intervals; inputs held "
    "as the drive holds them, parameters scaled, the noise's sizes given. It wins where it can "
    "be used at once for any robot that has an MJCF, and because every model's stiffness stands "
    "refitted beside its effect. Who writes no candidate finds none."
)


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [[case, *_cells(case, models)] for case, models in found.items()]
    head = ("hidden", "named by BIC", "its parameters (true)", "EI1, EI2 off", "processor time")
    return "\n\n".join([ABOUT, *([table(head, rows)] if rows else [])])


def _cells(case: str, models: Mapping[str, Any]) -> list[str]:
    first = named(models)
    one = models[first]["values"]
    true = {name: value for sizes in TRUTH[case].values() for name, value in sizes.items()}
    true |= {f"c{k}": 1.0 / true[f"k{k}"] for k in (1, 2) if f"k{k}" in true}
    true |= {"mt2": true["mt"]} if "mt" in true else {}
    said = ", ".join(
        f"{name} {value:.4g}" + (f" ({true[name]:.4g})" if name in true else "")
        for name, value in one.items() if not name.startswith("EI")
    )  # fmt: skip
    stiff = ", ".join(f"{100 * (one[f'EI{k}'] / 520.8333 - 1):+.1f} %" for k in (1, 2))
    spent = sum(m["seconds"] for m in models.values())
    return [first, said or "–", stiff, f"{spent:.0f} s"]
