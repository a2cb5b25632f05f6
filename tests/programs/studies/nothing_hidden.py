"""Nothing hidden, over noise, level and filter: `python -m tests.programs.studies.nothing_hidden`.

The scenarios that ship with simulated recordings, and every preset as a newcomer would try it, are
simulated from their own model and diagnosed. What is named is a false alarm. One line of JSON a
case; the same command goes on where it stopped.
"""

from __future__ import annotations

import time
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.arm.arm import Arm, Structure
from flexgui.core.arm.catalogue import ArmCatalogue
from flexgui.core.arm.compiled import compile_arm
from flexgui.core.arm.presets import presets
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from tests.programs.studies.plain_matrix import answered
from tests.programs.studies.plain_matrix_judge import spread
from tests.programs.studies.study_run import record_text, run_study, study_parser

REPOSITORY = Path(__file__).resolve().parents[3]
OUT = Path("reports/nothing_hidden.jsonl")

SEEDS = 100

SHIPPED = {
    "demo": REPOSITORY / "flexgui" / "demo.toml",
    "paper_glocal": REPOSITORY / "scenarios" / "paper_glocal.toml",
    "paper_local": REPOSITORY / "scenarios" / "paper_local.toml",
}

LOOP_HZ = 2.0
"""Of the velocity loops of the presets: their gain is 2 pi times this times the inertia, which is
what the paper's own loops amount to (60 N m s/rad around 4 kg m^2)."""

SNR_DB = (10.0, 40.0)
ENCODER_NOISE = (1e-6, 1e-4)
"""rad or m: a 20-bit encoder to a 12-bit one."""
CUTOFF_HZ = (10.0, 200.0)
LEVELS = ("auto", "lpv", "nonlinear")
PARAMETERS = {"paper": ["epsilon", "d"], "single_axis": ["m1"]}
"""Of a preset; EI1 and EI2 of the others."""


@dataclass(frozen=True)
class Case:
    """One scenario with nothing hidden in it."""

    what: str
    """shipped scenario or preset"""
    seed: int

    @property
    def key(self) -> str:
        return f"{self.what}/{self.seed}"


def cases(count: int) -> list[Case]:
    """One of each scenario and preset after the other."""
    names = [*SHIPPED, *(f"preset {name}" for name in presets())]
    return [Case(names[seed % len(names)], seed) for seed in range(1, count + 1)]


def document(case: Case) -> dict[str, Any]:
    """The scenario of a case: its noise, level and filter are drawn, nothing is hidden in it."""
    rng = np.random.default_rng([case.seed, 14])
    shipped = SHIPPED.get(case.what)
    stated = _preset(case.what.removeprefix("preset "), rng) if shipped is None else _read(shipped)
    stated["model"] = {"level": str(rng.choice(LEVELS))}
    stated["diagnose"] = {"max_effects": 3}
    snr = float(rng.uniform(*SNR_DB))
    noises = [float(np.exp(x)) for x in rng.uniform(*np.log(ENCODER_NOISE), 2)]
    stated["sensors"] = dict(zip(("encoder_noise", "deflection_noise"), noises, strict=True))
    if rng.random() < 1 / 3:
        cutoff = float(np.exp(rng.uniform(*np.log(CUTOFF_HZ))))
        stated["identify"]["filter"] = {"cutoff_hz": cutoff}
    for number, recording in enumerate(stated["recordings"]):
        seed = 1000 * case.seed + number
        noise = {} if "sweep" in recording["simulate"] else {"snr_db": snr}  # of metres, it is all
        recording["simulate"] = recording["simulate"] | noise | {"seed": seed}
    return stated


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _preset(name: str, rng: np.random.Generator) -> dict[str, Any]:
    arm = presets()[name]
    gains = [float(x) for x in 2.0 * np.pi * LOOP_HZ * _inertias(arm)]
    postures = rng.uniform(0.3, 2.8, 4)
    simulate = [{"theta2": float(x), "seconds": 3.0} if arm.joints > 1 else {} for x in postures]
    recordings = [{"simulate": one} for one in simulate]
    return {
        "title": f"Nothing hidden: {name}",
        "arm": {"preset": name},
        "drive": {"kind": "velocity_loop", "gains": gains},
        "identify": {"parameters": PARAMETERS.get(name, ["EI1", "EI2"])},
        "recordings": [*recordings[:-1], recordings[-1] | {"role": "validate"}],
    }


def _inertias(arm: Arm) -> np.ndarray:
    """(joints,) kg m^2 or kg: what each joint turns or pushes, the arm straight."""
    p = ArmCatalogue(arm).vectors([], np.zeros((1, 0)))[0]
    mass = compile_arm(Structure.of(arm)).mass_matrix(np.zeros(arm.coordinates), p)
    return np.diag(mass)[: arm.joints]


def answer_text(order: str) -> str:
    """The record of the case that a worker is sent."""
    return record_text(order, Case, run_case)


def run_case(case: Case) -> dict[str, Any]:
    """A record of plain values: what was drawn, and what was said."""
    scenario = Scenario.model_validate(document(case))
    clock = time.process_time()
    outcome = run_scenario(scenario, folder=REPOSITORY)
    assert outcome.diagnosis is not None
    first = scenario.recordings[0].simulate
    assert first is not None
    return {
        "key": case.key,
        "what": case.what,
        "level": scenario.model.level,
        "snr_db": first.snr_db,
        "encoder_noise": scenario.sensors.encoder_noise,
        "filter": None if scenario.identify.filter is None else scenario.identify.filter.cutoff_hz,
        "answer": answered(outcome.diagnosis, base_model(scenario)),
        "seconds": time.process_time() - clock,
    }


def false_alarms(record: Mapping[str, Any]) -> list[str]:
    """The physical effects that were named; a case that failed counts as one."""
    return list(record["answer"]["added"]) if "answer" in record else ["failed"]


def tables(records: Sequence[Mapping[str, Any]]) -> str:
    """How often something was named, where, and how p-values are spread: uniformly if right, where
    not the stated linear model is the error."""
    named = [r for r in records if false_alarms(r)]
    lines = [f"{len(records) - len(named)} of {len(records)} name nothing (asked: 98 of 100)"]
    for r in named:
        said = r.get("failed", ", ".join(false_alarms(r)))
        drawn = [f"{k} {r[k]}" for k in ("level", "snr_db", "filter") if k in r]
        lines.append(f"  {r['key']}: {said}; {', '.join(drawn)}")
    ended = [r["answer"] for r in records if "answer" in r]
    lines.append(f"verdicts: {dict(Counter(a['final_verdict'] for a in ended))}")
    full = [r["answer"] for r in records if "answer" in r and r["level"] != "lpv"]
    p_values = [p for a in full for p in a["p_values"].values()]
    lines += [spread(p_values)] if p_values else []
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is asked for and prints the table."""
    parser = study_parser("nothing_hidden", OUT)
    parser.add_argument("--cases", type=int, default=SEEDS)
    asked = parser.parse_args(arguments)
    chosen = cases(asked.cases)
    return run_study(chosen, answer_text, tables, asked)


if __name__ == "__main__":
    raise SystemExit(main())
