"""The next experiment on random rigs.

`python -m tests.programs.studies.next_experiments`, resumable.

Each case draws a rig of the plain matrix whose joints may rub, plans experiments for it from its
recordings, plays them on the true machine, and fits the model to everything. Counted are limits
that the machine violates, how near the deviations come to what was predicted, and the seconds.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flexgui.core.diagnose.stated_results import final_parameters
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import sizes_of
from flexgui.core.estimate.fit_result import with_robust_covariance
from flexgui.core.experiments.design import Candidate, Design, ExperimentRequest
from flexgui.core.experiments.plan import fit_for_planning, plan
from flexgui.core.loading import load_recordings
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.read import read_scenario, write_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.nonlinear import simulate_within
from tests.programs.studies.plain_matrix import written
from tests.programs.studies.plain_matrix_rigs import Rig, drawn
from tests.programs.studies.study_run import record_text, run_study, study_parser

OUT = Path("reports/next_experiments.jsonl")

RIGS = 200

SECONDS = 6.0
"""That the person has: two or three experiments."""

FRICTION = 0.02, 0.2
"""Of a joint's rms torque that is viscous friction, which the scenario states as an effect."""

NEAR = 0.2
"""Share by which a deviation may differ from the predicted one."""


@dataclass(frozen=True)
class Case:
    """One rig."""

    seed: int

    @property
    def key(self) -> str:
        return str(self.seed)


def answer_text(order: str) -> str:
    """The record of the case that a worker is sent."""
    return record_text(order, Case, run_case)


def run_case(case: Case) -> dict[str, Any]:
    """A record of plain values."""
    rig = drawn(case.seed)
    machine = _rubbing(rig, case.seed) if case.seed % 2 else rig.healthy
    recordings = rig.measured(rig.recordings(machine), case.seed)
    with TemporaryDirectory() as folder:
        path = written(Path(folder), rig, recordings)
        if machine is not rig.healthy:
            _state_friction(path)
        scenario = read_scenario(path)
        clock = time.perf_counter()
        design = plan(scenario, ExperimentRequest(seconds=SECONDS), folder=path.parent)
        seconds = time.perf_counter() - clock
        played = [_played(rig, machine, design, c) for c in design.chosen]
        deviations = _reached(rig, scenario, path.parent, design, [r for r, _ in played])
    return {
        "key": case.key,
        "joints": rig.joints,
        "drive": rig.drive["kind"],
        "used": [share for _, share in played],
        "seconds": seconds,
        "deviations": deviations,
    }


def _rubbing(rig: Rig, seed: int) -> Model:
    """The rig's machine with viscous friction in its joints."""
    rng = np.random.default_rng([seed, 18])
    sizes = sizes_of([rig.roughly(rig.healthy, i) for i in range(len(rig.postures))])
    shares = rng.uniform(*FRICTION, rig.joints)
    values = {
        f"fv{k + 1}": float(share * sizes.torque[k] / sizes.speed[k])
        for k, share in enumerate(shares)
    }
    return rig.healthy.with_effects([effect("viscous_friction")], values, sizes)


def _state_friction(path: Path) -> None:
    scenario = read_scenario(path)
    document = scenario.model_dump(exclude_unset=True)
    document["model"] = {"effects": [{"id": "viscous_friction"}]}
    write_scenario(Scenario.model_validate(document), path)


def _played(rig: Rig, machine: Model, design: Design, c: Candidate) -> tuple[Recording, float]:
    """What the true machine does, as the rig would write it; the share of the tightest limit."""
    task, _ = c.trial.task(machine)
    motion = simulate_within(machine, machine.numbers(), task, 1e-8).trajectory
    own, tip = design.limits.usage(motion)
    (noisy,) = rig.measured([rig.read(machine, task, motion)], 1000 + c.trial.seed)
    return noisy, float(max(np.max(own), tip))


def _reached(
    rig: Rig, scenario: Scenario, folder: Path, design: Design, more: Sequence[Recording]
) -> dict[str, list[float]]:
    """name -> [before, predicted, reached] deviations of a fit to all recordings."""
    there = load_recordings(scenario, base_model(scenario), folder, None, Silent())
    added = [replace(r, name=f"planned {n}") for n, r in enumerate(more, start=1)]
    begun = fit_for_planning(scenario, [*there, *added], Silent())
    found = {e.name: e.std for e in final_parameters(with_robust_covariance(begun.base))}
    return {
        d.estimate.name: [d.before, d.after, float(found[d.estimate.name])]
        for d in design.deviations
    }


def tables(records: Sequence[Mapping[str, Any]]) -> str:
    """What was asked, and what came out."""
    ended = [r for r in records if "failed" not in r]
    lines = [f"{len(ended)} of {len(records)} rigs planned"]
    lines += [f"  {r['key']}: {r['failed']}" for r in records if "failed" in r]
    used = [(max(r["used"], default=0.0), r["key"]) for r in ended]
    over = [key for share, key in used if share > 1.0]
    lines.append(f"limits violated on {len(over)} rigs (asked: none): {', '.join(over)}")
    if used:
        lines.append(f"  most used: {max(used)[0]:.3f} of the tightest limit")
    pairs = [x for r in ended for x in r["deviations"].values()]
    near = [abs(reached / predicted - 1.0) <= NEAR for _, predicted, reached in pairs]
    if pairs:
        gains = [before / reached for before, _, reached in pairs]
        lines.append(
            f"deviations within {100 * NEAR:.0f} % of the predicted: {sum(near)} of {len(near)}; "
            f"narrowed {np.median(gains):.2f} times in the median"
        )
        lines.append(f"seconds: most {max(r['seconds'] for r in ended):.1f} (asked: 20)")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is asked for and prints the table."""
    parser = study_parser("next_experiments", OUT)
    parser.add_argument("--rigs", type=int, default=RIGS)
    asked = parser.parse_args(arguments)
    chosen = [Case(seed) for seed in range(1, asked.rigs + 1)]
    return run_study(chosen, answer_text, tables, asked)


if __name__ == "__main__":
    raise SystemExit(main())
