"""The blind matrix over plain scenarios of random rigs.

`python -m tests.programs.studies.plain_matrix`.

Each case draws a rig, hides up to four effects (or something that no effect describes) in it, and
writes what a newcomer would have: recordings, and a scenario of arm, drive, files and parameters,
its stiffness wrong. That scenario is run from its file as `flexgui export` runs it, and what comes
out is compared with the truth. One line of JSON a case; the same command goes on where it stopped.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flexgui.core.challenge.detectability import UnreachableError
from flexgui.core.effects import catalogue
from flexgui.core.effects.sizes import typical
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.results import Diagnosis
from flexgui.core.scenario.read import read_scenario, write_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.verdict import verdict_paragraphs
from tests.programs.studies.plain_matrix_hidden import Sight, hide
from tests.programs.studies.plain_matrix_judge import judged, tables
from tests.programs.studies.plain_matrix_outside import OUTSIDE, disturbed
from tests.programs.studies.plain_matrix_rigs import Rig, drawn
from tests.programs.studies.study_run import record_text, run_study, study_parser

OUT = Path("reports/plain_matrix.jsonl")

CASES, STAND_INS = 400, 20

COUNTS = (0, 1, 2, 1, 3, 1, 2, -1, 0, 1, 4, 2, 1, 3, 0, 1, 2, 4, -1, 0)
"""How many effects are hidden, over twenty cases; -1: something outside of the catalogue."""

SLIPS = {
    "encoder_delay": "sensor_delay", "gauge_scale": "sensor_gain",
    "current_constant": "drive_gain", "loop_gain": "drive_gain",
}  # fmt: skip
"""Slip of a sensor or drive for which something mechanical may stand in -> the effect it is."""


@dataclass(frozen=True)
class Case:
    """One rig with what is hidden in it."""

    part: str
    """hidden, outside or stand_in"""
    what: str
    seed: int

    @property
    def key(self) -> str:
        return f"{self.part}/{self.what}/{self.seed}"


def cases(count: int, parts: Sequence[str]) -> list[Case]:
    """The first `count` of the matrix, and the slips."""
    found = []
    for seed in range(1, count + 1):
        hidden = COUNTS[(seed - 1) % len(COUNTS)]
        if hidden < 0:
            found.append(Case("outside", list(OUTSIDE)[seed % len(OUTSIDE)], seed))
        else:
            found.append(Case("hidden", str(hidden), seed))
    slips = [Case("stand_in", w, 10_000 + s) for s in range(1, STAND_INS + 1) for w in SLIPS]
    return [c for c in (*found, *slips) if c.part in parts]


def answer_text(order: str) -> str:
    """The record of the case that a worker is sent."""
    return record_text(order, Case, run_case)


def run_case(case: Case) -> dict[str, Any]:
    """A record of plain values: what was hidden, what was said, how right it was."""
    record: dict[str, Any] = {"key": case.key, "part": case.part, "what": case.what}
    clock = time.process_time()
    rig = drawn(case.seed, case.what if case.part == "stand_in" else "")
    sight, rng = Sight(rig), np.random.default_rng([case.seed, 2])
    record["rig"] = {
        "joints": rig.joints, "drive": rig.drive["kind"], "sensors": list(rig.kinds),
        "rate": rig.rate, "seconds": rig.seconds, "recordings": len(rig.postures) - 1,
        "cutoff": rig.cutoff, "starts": list(rig.starts),
    }  # fmt: skip
    try:
        machine, clean, hidden, truth, shown = _made(case, rig, sight, rng)
    except UnreachableError as error:
        return {**record, "unreachable": str(error)}
    ready = time.process_time()
    with TemporaryDirectory() as folder:
        path = written(Path(folder), rig, rig.measured(clean, 2))
        outcome = run_scenario(read_scenario(path), folder=path.parent)
    assert outcome.diagnosis is not None
    answer = answered(outcome.diagnosis, machine)
    truth = {**truth, **{f"EI{k + 1}": s["EI"] for k, s in enumerate(rig.segments)}}
    seconds = {"data": ready - clock, "answer": time.process_time() - ready}
    return record | {
        "hidden": list(hidden), "truth": truth, "shown": shown, "answer": answer,
        "judged": judged(hidden, answer, truth), "seconds": seconds,
    }  # fmt: skip


def _made(case: Case, rig: Rig, sight: Sight, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """The machine, recordings without noise, ids, values and what they show."""
    if case.part == "outside":
        clean, shown = disturbed(sight, case.what, rng)
        return rig.healthy, clean, (), {}, {case.what: shown}
    only = (SLIPS[case.what],) if case.part == "stand_in" else ()
    count = 1 if only else int(case.what)
    truth = hide(sight, count, rng, only, _SLIPPED.get(case.what, ""))
    return truth.machine, rig.recordings(truth.machine), truth.kinds, truth.values, truth.shown


_SLIPPED = {"encoder_delay": "te", "gauge_scale": "gg"}
"""Of effects about several kinds of channels, how the slip's parameters begin."""


def written(folder: Path, rig: Rig, recordings: Sequence[Recording]) -> Path:
    """Scenario and recordings as files; the scenario's path."""
    for r in recordings:
        save_recording(r, folder / f"{r.name}.csv")
    path = folder / "scenario.toml"
    write_scenario(Scenario.model_validate(rig.document()), path)
    return path


def answered(said: Diagnosis, machine: Model) -> dict[str, Any]:
    """What a diagnosis said, in plain values."""
    last, first = said.steps[-1], said.steps[0]
    ranking = said.rounds[0].ranking if said.rounds else ()
    confused = {
        r.accepted: list(x.confused_with)
        for r in said.rounds if r.accepted
        for x in r.ranking if x.effect == r.accepted
    }  # fmt: skip
    unseen = [_validation(s) for s in (first, last)]
    return {
        "verdict": said.verdict,
        "final_verdict": said.final_verdict,
        "added": [s.added for s in said.steps if s.added is not None],
        "kept": list(last.model),
        "confused": confused,
        "first_rms": float(np.sqrt(first.cost_per_sample)),
        "rms": float(np.sqrt(last.cost_per_sample)),
        "channels": {e.channel: round(e.rms / e.floor, 4) for e in last.errors},
        "validation": [] if None in unseen else unseen,
        "parameters": {
            e.name: (float(e.value), float(e.std) if np.isfinite(e.std) else None)
            for e in said.parameters
        },
        "origins": dict(said.origins),
        "p_values": _plain_p_values(said, machine),
        "top": [
            [x.effect, x.refit_drop_percent, x.delta_bic, round(x.score, 1)] for x in ranking[:5]
        ],
        "words": list(verdict_paragraphs(said)),
    }


def _validation(step: Any) -> float | None:
    """Floors, rms over channels."""
    shares = [e.validation_rms / e.floor for e in step.errors]
    found = float(np.sqrt(np.mean(np.square(shares)))) if shares else np.nan
    return found if np.isfinite(found) else None


def _plain_p_values(said: Diagnosis, machine: Model) -> dict[str, float]:
    """Of the first round's candidates that were not refitted and have no grids and no signs: only
    there is the score chi-squared with nothing chosen."""
    found = {}
    arm = (machine.bare or machine).arm
    for x in said.rounds[0].ranking if said.rounds else ():
        one = catalogue()[x.effect]
        knobs = one.parameters(one.changed_arm(arm, {}), machine.drive, typical(arm))
        free = all(k.parameter.lower < k.neutral < k.parameter.upper for k in knobs)
        if x.refit_drop_percent is None and knobs and free and not any(k.grid for k in knobs):
            found[x.effect] = float(x.p_value)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is asked for and prints the tables."""
    parser = study_parser("plain_matrix", OUT)
    parser.add_argument("--cases", type=int, default=CASES, help="how many of the matrix")
    parser.add_argument("--parts", default="hidden,outside,stand_in", help="some of these")
    parser.add_argument("--only", default="", help="keys of cases, by commas")
    asked = parser.parse_args(arguments)
    chosen = cases(asked.cases, asked.parts.split(","))
    if asked.only:
        chosen = [c for c in chosen if c.key in asked.only.split(",")]
    return run_study(chosen, answer_text, tables, asked)


if __name__ == "__main__":
    raise SystemExit(main())
