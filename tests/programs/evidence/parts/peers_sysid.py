"""`mujoco.sysid` on the independent engine's recordings: one model per candidate, each refitted."""

from __future__ import annotations

import io
import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from tests.programs.evidence.frame import Summary, better, table
from tests.programs.mujoco.cases import CASES as ENGINE_CASES

TITLE = "Peers on equal data: mujoco.sysid"
ORDER = 3
FILES: tuple[str, ...] = ()
NEEDS = ("mujoco", "absl", "colorama", "tabulate")
SOURCES = ("evidence/chain_models.py", "mujoco/cases.py", "mujoco/chain.py")

FOLDER = Path(__file__).resolve().parents[4] / "scenarios" / "mujoco"
TRUTH = tomllib.loads((FOLDER / "truth.toml").read_text(encoding="utf-8"))
SINGLE = tuple(name for name, effects in TRUTH.items() if len(effects) < 2)
ITERATIONS = 25
OPTIONS = {"max_iters": ITERATIONS, "x_scale": "jac", "mu_factor": 10.0, "xtol": 1e-4}
"""Of its optimiser. By default it raises its regularisation by a quarter from a millionth on, a
hundred simulations for a step that is refused, and goes on to eight digits."""


def refitted(case: str, _: Path) -> dict[str, Any]:
    """candidate -> its χ², parameters in SI with their 95 % intervals, and processor time; beside
    what FlexGUI's diagnosis says."""
    from tests.programs.evidence import chain_models

    data = chain_models.recordings(FOLDER / case)
    rotors = next(known.rotors for known in ENGINE_CASES if known.name == case)
    found = {"nothing": _fitted("nothing", data, rotors, {})}
    for name in chain_models.CANDIDATES:
        start = found["nothing"]["values"]
        found[name] = found.get(name) or _fitted(name, data, rotors, start)
    return {"models": found, "ours": _diagnosed(case, chain_models.RECORDINGS)}


def _diagnosed(case: str, names: Sequence[str]) -> dict[str, Any]:
    """By the plain scenario, of the same recordings alone."""
    path, clock = FOLDER / "plain" / f"{case}.toml", time.process_time()
    scenario = read_scenario(path)
    used = tuple(r for r in scenario.recordings if any(f"{n}." in str(r.file) for n in names))
    scenario = scenario.model_copy(update={"recordings": used})
    found = run_scenario(scenario, folder=path.parent).diagnosis
    assert found is not None
    values = {e.name: e.value for e in found.parameters if e.recording is None}
    seconds = time.process_time() - clock
    return {"named": list(found.kept), "values": values, "seconds": seconds}


def _fitted(
    candidate: str, data: Any, rotors: tuple[float, float], known: Mapping[str, float]
) -> dict[str, Any]:
    """Starts at what is `known` in SI; `rotors` as the plain scenario states them."""
    from mujoco import sysid

    from tests.programs.evidence import chain_models

    knobs, count = chain_models.knobs(candidate), [0]
    clock = time.process_time()
    parameters = sysid.ParameterDict()
    for name, k in knobs.items():
        start = known[name] / k.scale if name in known else k.start
        parameters.add(sysid.Parameter(name, nominal=start, min_value=k.lower, max_value=k.upper))

    def errors(x: np.ndarray, _: Any, **__: Any) -> tuple[list[np.ndarray], list, list]:  # type: ignore[type-arg]
        columns = x.reshape(len(knobs), -1).T
        count[0] += len(columns)
        found = [
            chain_models.errors(candidate, _in_si(knobs, column), data, rotors)
            for column in columns
        ]
        return [np.array(found).T if x.ndim > 1 else found[0]], [], []

    with redirect_stdout(io.StringIO()):  # its optimiser prints every iteration
        best, end = sysid.optimize(parameters, errors, verbose=False, **OPTIONS)
    residual = errors(best.as_vector(), None)[0]
    _, halves = sysid.calculate_intervals(residual, np.asarray(end.jac))
    scales = [k.scale for k in knobs.values()]
    return {
        "chi2": float(residual[0] @ residual[0]),
        "count": len(residual[0]),
        "values": _in_si(knobs, best.as_vector()),
        "intervals": dict(zip(knobs, (halves * scales).tolist(), strict=True)),
        "simulations": count[0],
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
    "candidates, starts the bare one with both stiffnesses 30 % off and the others where it ends, "
    "and takes the one with the least χ² after the price of its parameters (BIC). Its optimiser "
    "and intervals; inputs held as the drive holds them, parameters scaled, the noise's sizes "
    "given. FlexGUI diagnoses the same three files by the plain scenario. `mujoco.sysid` wins "
    "where it can be used at once for any robot that has an MJCF, and because every model's "
    "stiffness stands refitted beside its effect. Who writes no candidate finds none."
)


def summary(found: Mapping[str, Any]) -> Summary:
    """How often just what is hidden is named."""
    if not found:
        return []
    peer = sum(_right(case, [named(one["models"])]) for case, one in found.items())
    ours = sum(_right(case, one["ours"]["named"]) for case, one in found.items())
    spent = (
        sum(one["ours"]["seconds"] for one in found.values()),
        sum(m["seconds"] for one in found.values() for m in one["models"].values()),
    )
    return [(
        "engine, three recordings: just what is hidden is named",
        f"{ours} of {len(found)} in {spent[0]:.0f} s",
        f"{peer} of {len(found)} in {spent[1]:.0f} s, mujoco.sysid", better(-ours, -peer),
    )]  # fmt: skip


def _right(case: str, names: Sequence[str]) -> bool:
    return set(names) - {"nothing"} == set(TRUTH[case])


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [
        line
        for case, one in found.items()
        for line in (_peer_cells(case, one["models"]), _our_cells(case, one["ours"]))
    ]
    head = ("hidden", "by", "named", "its parameters (true)", "EI1, EI2 off", "processor time")
    return "\n\n".join([ABOUT, *([table(head, rows)] if rows else [])])


def _peer_cells(case: str, models: Mapping[str, Any]) -> list[str]:
    first, spent = named(models), sum(m["seconds"] for m in models.values())
    return [case, "mujoco.sysid", first, *_values(case, models[first]["values"]), f"{spent:.0f} s"]


def _our_cells(case: str, one: Mapping[str, Any]) -> list[str]:
    names = ", ".join(one["named"]) or "nothing"
    return ["", "FlexGUI", names, *_values(case, one["values"]), f"{one['seconds']:.0f} s"]


def _values(case: str, values: Mapping[str, float]) -> tuple[str, str]:
    true = {name: value for sizes in TRUTH[case].values() for name, value in sizes.items()}
    true |= {f"c{k}": 1.0 / true[f"k{k}"] for k in (1, 2) if f"k{k}" in true}
    true |= {"mt2": true["mt"]} if "mt" in true else {}
    said = ", ".join(
        f"{name} {value:.4g}" + (f" ({true[name]:.4g})" if name in true else "")
        for name, value in values.items() if not name.startswith("EI")
    )  # fmt: skip
    stiff = ", ".join(f"{100 * (values[f'EI{k}'] / 520.8333 - 1):+.1f} %" for k in (1, 2))
    return said or "–", stiff
