"""A folder with the next experiments: references to play, and a scenario that reads them back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.experiments.design import MOST_EXPERIMENTS, Candidate, Design, ExperimentRequest
from flexgui.core.experiments.design_files import Names, expected, references, with_planned
from flexgui.core.experiments.plan import plan
from flexgui.core.loading import joint_units
from flexgui.core.progress import Progress
from flexgui.core.recording.save import save_recording
from flexgui.core.scenario.read import check_scenario, document_toml, read_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.export.export_files import seen_by
from flexgui.export.folder import check_writable, dumps, work_folder
from flexgui.sentences.experiments import plan_paragraphs

SCENARIO = "planned.toml"
"""Beside the scenario that was planned for, or in an export's folder, it takes nothing's place."""
PLAN = "plan.json"
TEXT = "plan.txt"

LONGEST_PLAN = 86_400.0
"""s that a person may have: a day."""


def plan_scenario(
    path: Path, out: Path, data: Path | None, seconds: float,
    parameters: Sequence[str], between: Sequence[str], progress: Progress,
) -> Sequence[str]:  # fmt: skip
    """Reads a scenario, plans experiments of `seconds` together, writes them, and returns closing
    lines.

    Raises:
        InputError: Where the scenario, a recording or an option is wrong.
    """
    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is no folder; name the one that holds the recordings.")
    if not (math.isfinite(seconds) and 0.0 < seconds <= LONGEST_PLAN):
        raise InputError(f"--seconds must be above 0 and at most {LONGEST_PLAN:.0f}.")
    if len(between) not in (0, 2):
        raise InputError("--between takes two ids of effects, such as tip_payload,link_mass_error.")
    scenario = read_scenario(path)
    check_writable(out)
    request = ExperimentRequest(seconds, tuple(parameters), tuple(between), scenario.limits)
    design = plan(scenario, request, folder=path.parent, data_folder=data, progress=progress)
    write_plan(scenario, design, out, seen_by(out, path.parent, data))
    files = [Names(n).recorded for n, _ in enumerate(design.chosen, start=1)]
    closing = f"Save what is recorded beside them as {files[0]}" if files else ""
    more = ", and so on" if len(files) > 1 else ""
    ending = f"{closing}{more}; {out / SCENARIO} then reads them." if files else ""
    return [*plan_paragraphs(design), ending]


def write_plan(
    scenario: Scenario, design: Design, out: Path, locate: Callable[[str], str] = lambda file: file
) -> None:
    """References, what to expect, the plan in words and numbers, and the scenario for after.

    `locate` says how the new scenario names a file of the old one.
    """
    units = joint_units(design.fitted.model.arm)
    document = with_planned(scenario, design, locate)
    check_scenario(document, SCENARIO)
    with work_folder(out) as folder:
        for n, c in enumerate(design.chosen, start=1):
            save_recording(references(c, design), folder / Names(n).play, units)
            save_recording(expected(c, design), folder / Names(n).expected, units)
        (folder / PLAN).write_text(dumps(_as_document(design)), encoding="utf-8")
        (folder / TEXT).write_text("\n\n".join(plan_paragraphs(design)) + "\n", encoding="utf-8")
        (folder / SCENARIO).write_text(document_toml(document), encoding="utf-8")
        for path in folder.iterdir():
            path.replace(out / path.name)
    # References of an older plan go, so that nobody plays them; recordings stay.
    for n in range(len(design.chosen) + 1, MOST_EXPERIMENTS + 1):
        for name in (Names(n).play, Names(n).expected):
            (out / name).unlink(missing_ok=True)


def _as_document(design: Design) -> dict[str, Any]:
    """The design in plain values, as `plan.json` holds it."""
    return {
        "words": list(plan_paragraphs(design)),
        "experiments": [
            {
                "play": Names(n).play, "recorded": Names(n).recorded, "start": list(c.trial.start),
                "seconds": c.trial.seconds, "form": c.trial.form,
                "amplitudes": list(c.trial.amplitudes), "tightest_limit": _tightest(c, design),
                "score": c.score,
            }
            for n, c in enumerate(design.chosen, start=1)
        ],
        "limits": {
            "position": design.limits.position.tolist(), "speed": design.limits.speed.tolist(),
            "torque": design.limits.torque.tolist(), "reach": design.limits.reach.tolist(),
        },
        "deviations": [
            {
                "name": d.estimate.name, "unit": d.estimate.unit, "value": d.estimate.value,
                "before": d.before, "after": d.after,
            }
            for d in design.deviations
        ],
        "between": list(design.competing),
        "score": design.score,
    }  # fmt: skip


def _tightest(c: Candidate, design: Design) -> float:
    """Share of the tightest limit that an experiment uses, by the fitted model."""
    own, tip = design.limits.usage(c.trial.motion(design.fitted))
    return float(max(np.max(own), tip))
