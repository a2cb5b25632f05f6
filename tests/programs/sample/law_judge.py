"""How right the laws are that are proposed for hidden ones.

`python -m tests.programs.sample.law_judge FOLDER [words]` takes the folders of
`tests.programs.sample.hidden_laws`:
the model as given, or with `--diagnose` the one that the diagnosis ends with.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.diagnose import diagnose, fit_base_to_recordings
from flexgui.core.diagnose.search_options import Options
from flexgui.core.effects.formula import parse_formula
from flexgui.core.effects.formula_functions import with_expanded_tables
from flexgui.core.identify.setup import Setup, make_setup
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.propose.propose import propose
from flexgui.core.propose.variables import share_of_bristle
from flexgui.core.results import Proposal, ProposedLaw, RankedEffect
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model, with_effect_parameters
from flexgui.core.workbench import stated_noise

RIGHT_SHAPE = 0.1
"""Relative rms difference along the motion up to which a law is right."""

SLOW = 5e-3
"""rad/s: as dry friction is made in the engine."""

RIGHT_ERROR = 1.5
"""Noise floors that a right law may leave."""


def fits(folder: Path, diagnosed: bool) -> tuple[BaseFit, Sequence[RankedEffect], Options]:
    """The fitted model of a folder's scenario, and the listed effects ranked on it."""
    scenario = read_scenario(folder / "scenario.toml")
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    recordings = list(load_recordings(scenario, model, folder, None, Silent()))
    setup: Setup = make_setup(model, spec, recordings)
    options = Options(
        max_effects=scenario.diagnose.max_effects, fidelity=scenario.diagnose.fidelity,
        stated_rig=scenario.rig.statements, stated_noise=stated_noise(scenario, setup, recordings),
        compare=False,
    )  # fmt: skip
    base = fit_base_to_recordings(setup, spec, recordings, options, Silent())
    if not diagnosed:
        return base, (), options
    ended: list[BaseFit] = []
    found = diagnose(setup, spec, recordings, options, base_fit=base, on_end=ended.append)
    return ended[-1], found.rounds[-1].ranking if found.rounds else (), options


_FRICTION = re.compile(r"friction\((\w+)\)")
_HYSTERESIS = re.compile(r"hysteresis\((\w+), (\w+|[\d.e-]+)\)")


def along(law: ProposedLaw, truth: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    """(N,) what a law adds along the true motion of a recording; NaN where it depends on what the
    truth does not hold."""
    values = {e.name: e.value for e in law.parameters}
    at: dict[str, np.ndarray | float] = {
        "t": truth[f"{name}/time"] - truth[f"{name}/time"][0],
        **{f"theta{k + 1}": x for k, x in enumerate(truth[f"{name}/angles"].T)},
        **{f"dtheta{k + 1}": x for k, x in enumerate(truth[f"{name}/rates"].T)},
        **{f"u{k + 1}": x for k, x in enumerate(truth[f"{name}/drive"].T)},
        **{f"z{k + 1}": x for k, x in enumerate(truth[f"{name}/tip"].T)},
        **({"input1": truth[f"{name}/column"]} if f"{name}/column" in truth else {}),
        **values,
    }

    def direction(found: re.Match[str]) -> str:
        at["direction"] = np.tanh(at[f"d{found[1]}"] / SLOW)
        return "direction"

    def share(found: re.Match[str]) -> str:
        way = values[found[2]] if found[2] in values else float(found[2])
        at["share"] = share_of_bristle(np.asarray(at[found[1]]), way)
        return "share"

    text = _HYSTERESIS.sub(share, _FRICTION.sub(direction, law.formula))
    if not set(re.findall(r"\b[a-z_]+\d*\b(?!\()", text)) <= set(at):
        return np.full(len(truth[f"{name}/time"]), np.nan)
    symbols = {word: sp.Symbol(word, real=True) for word in at}
    expression = with_expanded_tables(parse_formula(text, symbols), law.title)
    value = sp.lambdify(list(symbols.values()), expression, modules="numpy")(*at.values())
    return np.broadcast_to(value, truth[f"{name}/time"].shape)


def shape_error(law: ProposedLaw, truth: Mapping[str, np.ndarray], names: Sequence[str]) -> float:
    """Relative rms difference of the law from the true one along the motions."""
    pairs = [(along(law, truth, n), truth[f"{n}/law"]) for n in names]
    missed, whole = (np.concatenate([f(a, b) for a, b in pairs]) for f in (np.subtract, _second))
    return float(np.linalg.norm(missed) / np.linalg.norm(whole))


def _second(_: np.ndarray, b: np.ndarray) -> np.ndarray:
    return b


def line(folder: Path, proposal: Proposal, seconds: float) -> str:
    """One line on what was proposed, with what is right of it."""
    said: dict[str, Any] = json.loads((folder / "truth.json").read_text())
    best = proposal.carriers[0] if proposal.carriers else None
    carrier = best and f"{best.target} {best.variable} {best.factor} {best.share:.3f}"
    head = f"{said['name']:34} {seconds:5.0f} s"
    if said["nothing"]:
        right = "right" if not proposal.laws else "WRONG"
        shown = [law.formula for law in proposal.laws]
        return f"{head} {right} {proposal.reason} [{carrier}] {shown}"
    if not proposal.laws:
        refused = [(t, str(o.reason)) for t, o in proposal.refused]
        true = f"{said['target']} {said['variable']}"
        return f"{head} none: {proposal.reason} [{carrier}] {refused} truth {true}"
    truth = np.load(folder / "truth.npz")
    law = proposal.laws[0]
    names = list(said["recordings"])
    error = shape_error(law, truth, names)
    words = [t.carrier.variable.removeprefix("hysteresis(").split(",")[0] for t in law.terms]
    named = law.target == said["target"] and said["variable"] in words
    marks = [
        "carrier" if named else f"CARRIER {law.target} {law.carrier.variable}",
        f"shape {error:.3f}" if error <= RIGHT_SHAPE else f"SHAPE {error:.3f}",
        f"{'error' if law.rms[1] <= RIGHT_ERROR else 'ERROR'} {law.rms[0]:.2f}->{law.rms[1]:.2f}",
        f"unseen {law.unseen_rms[0]:.2f}->{law.unseen_rms[1]:.2f}",
    ]
    return f"{head} {', '.join(marks)} | {law.formula} [{carrier}] {len(proposal.laws)} laws"


def main() -> None:
    """Judges the folders and prints a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--diagnose", action="store_true", help="propose for the diagnosed model")
    asked = parser.parse_intermixed_args()
    for folder in sorted(p.parent for p in asked.folder.glob("*/truth.json")):
        if asked.words and not any(word in folder.name for word in asked.words):
            continue
        base, ranking, options = fits(folder, asked.diagnose)
        clock = time.perf_counter()
        proposal = propose(base, options, ranking=ranking)
        print(line(folder, proposal, time.perf_counter() - clock), flush=True)


if __name__ == "__main__":
    main()
