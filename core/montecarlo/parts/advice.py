"""Fisher information of experiments: the study's own, and candidates over the whole range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...identify.identifiability import relative_scales
from ...identify.predictor import Predictor
from ...identify.residuals import Residuals, channel_weights
from ...identify.unknowns import collect_unknowns
from ...montecarlo.rig import Rig, outputs
from ...montecarlo.settings import StudySettings
from ...montecarlo.study import Answer, Case, Part
from ...recording.recording import Recording
from ...scenario.schema import IdentifySpec

CANDIDATE_POINTS = 15
"""Working points of the candidates, over the range of the study's."""

EXCITATIONS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("balanced PRBS, 20 ms", {"excitation": "prbs_balanced", "hold": 0.02}),
    ("balanced PRBS, 10 ms", {"excitation": "prbs_balanced", "hold": 0.01}),
    ("balanced PRBS, 50 ms", {"excitation": "prbs_balanced", "hold": 0.05}),
    ("PRBS, 20 ms", {"excitation": "prbs", "hold": 0.02}),
    ("multisine to 50 Hz", {"excitation": "multisine"}),
    ("chirp to 50 Hz", {"excitation": "chirp"}),
)
"""All of the amplitude and the length of the study's own."""

ADVICE_SEED = 4001
OWN = "own"

RELATIVE_STEP = 1e-4
"""Of the differences that show how a stiffness follows from the parameters."""


class Advice(Part):
    """One working point, all excitations; and the experiments that the study makes."""

    kind = "advice"
    title = "Experiment advice"
    order = 3

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        own = Case(self.kind, f"advice/{OWN}", {"point": None})
        points = range(1, CANDIDATE_POINTS + 1)
        return (own, *(Case(self.kind, f"advice/{k:02d}", {"point": k}) for k in points))

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        if options["point"] is None:
            named = [(r.name, r) for r in rig.experiments()]
        else:
            named = _candidates(rig, options["point"])
        experiments = [{"name": name, **relative_normal_equations(rig, r)} for name, r in named]
        names, rows = targets(rig)
        return {"experiments": experiments, "targets": names, "gradients": rows}


def _candidates(rig: Rig, point: int) -> list[tuple[str, Recording]]:
    low, high = min(rig.settings.points), max(rig.settings.points)
    theta2 = low + (high - low) * (point - 1) / (CANDIDATE_POINTS - 1)
    like = rig.settings.experiments[0].simulate
    assert like is not None
    base = {"theta2": float(theta2), "seed": ADVICE_SEED + point, "options": {}}
    return [
        (name, rig.recording(like.model_copy(update={**base, **update}), name))
        for name, update in EXCITATIONS
    ]


def relative_normal_equations(rig: Rig, recording: Recording) -> Answer:
    """S'S (P, P) per channel with S the sensitivity of ydot to relative changes of the
    parameters, and S'(y - y_lpv): what the linear model's own error pulls at them."""
    residuals = _residuals(rig, [recording])
    vector = residuals.unknowns.parameters.vector()
    scales = relative_scales(residuals.unknowns, vector)
    S = -residuals.slopes(vector)[0] * scales
    error = residuals.blocks(vector)[0]
    return {
        "theta2": recording.theta2,
        "seconds": float(len(recording.time) * recording.sample_time),
        "information": [(S[:, c].T @ S[:, c]).tolist() for c in range(S.shape[1])],
        "pull": np.einsum("tcp,tc->p", S, error).tolist(),
        "signal_std": outputs(recording).std(axis=0).tolist(),
    }


def _residuals(rig: Rig, recordings: Sequence[Recording]) -> Residuals:
    spec = IdentifySpec(parameters=rig.settings.scenario.identify.parameters, output=("ydot",))
    unknowns = collect_unknowns(rig.model, spec, recordings)
    experiments = [rig.prepared(r) for r in recordings]
    return Residuals(Predictor(experiments, unknowns), channel_weights(experiments, {}))


def targets(rig: Rig) -> tuple[list[str], list[list[float]]]:
    """What can be known: stiffnesses that follow from the parameters, and each parameter that
    is no part of one; with the relative change of each per relative change of the parameters."""
    names = rig.settings.scenario.identify.parameters
    base = {n: rig.model.parameter(n).value for n in names}
    still = np.array(rig.stiffness(base))
    slopes = np.zeros((len(still), len(names)))
    for j, n in enumerate(names):
        moved = rig.stiffness({**base, n: base[n] * (1.0 + RELATIVE_STEP)})
        slopes[:, j] = (np.array(moved) / still - 1.0) / RELATIVE_STEP
    kept = [k for k in range(len(still)) if np.any(slopes[k])]
    labels = ["EI" if len(still) == 1 else f"EI{k + 1}" for k in kept]
    rows = [slopes[k].tolist() for k in kept]
    for j, n in enumerate(names):
        if not np.any(slopes[:, j]):
            labels.append(n)
            rows.append([1.0 if i == j else 0.0 for i in range(len(names))])
    return labels, rows
