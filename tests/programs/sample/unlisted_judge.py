"""What a diagnosis says of recordings with what is on no list, and what of it is right."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.processors import at_most
from flexgui.core.results import Diagnosis, ProposedLaw
from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.figures import validation_rms
from tests.programs.mujoco.hidden_laws import HYSTERESIS
from tests.programs.sample.law_judge import shape_error

RIGHT_SHAPE, RIGHT_ERROR = 0.15, 1.5
"""Relative, along the unseen motion; noise floors there."""
NEAR = 0.05
"""Relative, of a frequency."""


def judged(folder: Path, unseen: Sequence[str]) -> dict[str, Any]:
    """What the diagnosis of a folder says, and what of it is right; no fit sees the `unseen`
    recordings."""
    with at_most(1):
        clock, cpu = time.perf_counter(), time.process_time()
        outcome = run_scenario(read_scenario(folder / "scenario.toml"), folder=folder)
        clock, cpu = time.perf_counter() - clock, time.process_time() - cpu
    diagnosis = outcome.diagnosis
    assert diagnosis is not None
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    proposal = diagnosis.proposal
    laws = () if proposal is None else proposal.laws
    found: dict[str, Any] = {
        "name": folder.name, "cpu": round(cpu, 1), "seconds": round(clock, 1),
        "proposal_seconds": None if proposal is None else round(proposal.seconds, 1),
        "kept": list(diagnosis.steps[-1].model), "verdict": diagnosis.standing_verdict,
        "unseen": _unseen(diagnosis),
        "laws": [law.formula for law in laws],
        "carriers": [] if proposal is None else [
            f"{c.target} {c.variable} {c.factor} {c.share:.3f}" for c in proposal.carriers[:2]
        ],
        "reason": "" if proposal is None else proposal.reason,
        "line": diagnosis.error_left.line,
        "events": [] if proposal is None else [
            (e.recording, e.start, e.stop, e.target) for e in proposal.events
        ],
    }  # fmt: skip
    if truth["law"] and laws:
        found |= _of_law(truth["law"], laws[0], folder, unseen)
    return found | {"right": _right(found, truth)}


def _right(found: Mapping[str, Any], truth: Mapping[str, Any]) -> list[str]:
    """What of a record is right, in words."""
    named = found["kept"] or found["laws"]
    right = [] if found["kept"] else ["no false effect"]
    if truth["law"]:
        right += ["carrier"] if found.get("carrier") else []
        right += ["shape"] if found.get("shape", np.inf) <= RIGHT_SHAPE else []
        right += ["unseen"] if (found.get("law_unseen") or [np.inf])[-1] <= RIGHT_ERROR else []
    elif truth["pushes"]:
        spans = {f"posture{n}": (p["start"], p["start"] + p["seconds"])
                 for n, p in enumerate(truth["pushes"])}  # fmt: skip
        hit = [start < spans[name][1] and spans[name][0] < stop and target == "tip"
               for name, start, stop, target in found["events"]]  # fmt: skip
        right += ["event"] if hit and all(hit) and not named else []
    elif truth["stand"]:
        line, hz = found["line"], truth["stand"]["hz"]
        near = line is not None and abs(line[1] - hz) < NEAR * hz
        right += ["line"] if near and not named else []
    else:
        right += [] if named or found["events"] else ["nothing"]
    return right


def _unseen(diagnosis: Diagnosis) -> float | None:
    rms = validation_rms(diagnosis.steps[-1].errors)
    return round(rms, 2) if np.isfinite(rms) else None


CARRIERS = {
    "speed_power": ("dtheta{t}", ""), "place_bump": ("theta{t}", ""),
    "falling_friction": ("dtheta{t}", ""), "column_torque": ("input1", ""),
    "column_friction": ("input1", "times the sign of the speed"),
    HYSTERESIS: ("hysteresis(theta{t}", ""), "load_damping": ("u{t}", "times the speed"),
    "speeds_product": ("dtheta{t}", "times the speed of joint {c}"),
    "damping_over_other": ("theta{c}", "times the speed"),
}  # fmt: skip
"""Form -> how the variable begins, and what its function is multiplied by; t is the joint that is
pushed, c the one whose angle is read."""


def _of_law(
    law: Mapping[str, Any], first: ProposedLaw, folder: Path, unseen: Sequence[str]
) -> dict[str, Any]:
    truth = np.load(folder / "truth.npz")
    number = {"t": law["target"] + 1, "c": law["carrier"] + 1}
    word, factor = (text.format(**number) for text in CARRIERS[law["form"]])
    carriers = [t.carrier for t in first.terms]
    at = first.target == f"joint{law['target'] + 1}"
    found = any(c.variable.startswith(word) and c.factor == factor for c in carriers)
    return {
        "carrier": at and found, "shape": round(shape_error(first, truth, unseen), 3),
        "law_rms": [round(x, 2) for x in first.rms],
        "law_unseen": [round(x, 2) for x in first.unseen_rms],
    }  # fmt: skip


def line(found: Mapping[str, Any]) -> str:
    """A case in one line."""
    if "failed" in found:
        return f"{found['name']:28} FAILED {found['failed']}"
    head = f"{found['name']:28} {found['cpu']:5.0f} s {', '.join(found['right']):38} "
    head += f"{found['verdict']:16} {'+'.join(found['kept']) or '-'}"
    if found["events"]:
        return f"{head} | {found['events']}"
    if found["laws"]:
        marks = (
            f"shape {found['shape']} {found['law_rms']} unseen {found['law_unseen']}"
            if "carrier" in found
            else "LAW"
        )
        return f"{head} | {marks} | {found['laws'][0]} | {found['carriers'][:1]}"
    return f"{head} | {found['reason']} {found['carriers']} {found['line']}"


def summary(records: Sequence[Mapping[str, Any]]) -> str:
    """How many records are right in what."""
    ended = [r for r in records if "right" in r]
    counts = Counter(what for r in ended for what in r["right"])
    words = ", ".join(f"{what} {count}" for what, count in sorted(counts.items()))
    return f"{len(ended)} of {len(records)} ended: {words}"
