"""What a fitted model says of its parameters: their sizes, and what each belongs to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..diagnose.base_fit import Begun
from ..diagnose.fit_problem import Data, Hypothesis
from ..diagnose.ladder_steps import estimates
from ..diagnose.missing_torque import missing_torque
from ..diagnose.refit import Refit, robust_covariance
from ..identify import identifiability
from ..identify.compare import compare
from ..identify.estimates import derived_estimates
from ..identify.predictor import on_all_cores
from ..identify.prepared import Prepared
from ..least_squares import SEEN, whole
from ..results import Estimate, RecordingComparison
from ..results.comparison import DIAGNOSIS_FIT


def final_parameters(refit: Refit) -> tuple[Estimate, ...]:
    """All shared unknowns of a fitted model and what follows from them, with what the data fix."""
    h = refit.hypothesis
    x, unknowns = h.vector, h.unknowns
    if not len(unknowns):
        return ()
    sensitivities = [whole(S) for S in h.residuals.sensitivities(x)]
    jacobian = h.residuals.vector(sensitivities)
    _, _, null = identifiability.analyse(unknowns, x, jacobian)
    seen = identifiability.identified(null, len(unknowns))
    shared = [i for i, u in enumerate(unknowns.items) if u.recording is None]
    # What sits at a bound may be there because nothing else holds it.
    known = robust_covariance(refit, SEEN, released=True)
    whole_std = np.sqrt(np.maximum(np.diag(robust_covariance(refit, released=True)), 0.0))
    free = {unknowns.items[i].parameter.name: float(whole_std[i]) for i in shared}
    alone = identifiability.determined(unknowns, x, known, null)
    shown = {unknowns.items[i].parameter.name: bool(alone[i]) for i in shared if seen[i]}
    listed = [
        replace(e, identifiable=shown[e.name], std=e.std if shown[e.name] else free[e.name])
        if e.name in shown
        else replace(e, std=float("nan"), identifiable=False)
        for e in estimates(refit)
    ]
    return (*listed, *derived_estimates(h.model, unknowns, x, known, null))


def origins(refit: Refit, data: Data) -> dict[str, str]:
    """Name of a parameter -> arm, drive, sensor, or the id of the effect it belongs to."""
    model = refit.hypothesis.model
    found = dict.fromkeys(model.arm_catalogue.entries, "arm")
    found |= {p.name: "drive" for p in model.drive.parameters(model.arm)}
    for one in model.effects:
        found |= dict.fromkeys(
            (k.parameter.name for k in one.parameters(model.arm, model.drive, data.sizes)), one.kind
        )
    names = {u.parameter.name for u in refit.hypothesis.unknowns.items}
    return {name: found.get(name, "sensor") for name in sorted(names)}


def compared(begun: Begun) -> tuple[RecordingComparison, ...]:
    """All recordings: those fitted, then those that no fit saw, with starts of their own."""
    pairs = [(begun.base.hypothesis, begun.data)]
    if (later := begun.validated) is not None:
        pairs.append((later.hypothesis, later.data))
    found: list[RecordingComparison] = []
    agility: float | None = None  # once chosen it serves all
    for h, data in pairs:
        for i, one in enumerate(_each(h, data)):
            missing, agility = missing_torque(h, i, one, data.floors, agility)
            found.append(replace(one, missing_torque=missing) if missing else one)
    return tuple(found)


def _each(h: Hypothesis, data: Data) -> tuple[RecordingComparison, ...]:
    predictor = h.residuals.predictor

    def one(e: Prepared) -> RecordingComparison:
        own = h.unknowns.values_for(e.recording.name, h.vector)
        values = {**predictor.fixed, **own}
        return compare(
            h.model, e.recording, e.outputs, e.processing, values, DIAGNOSIS_FIT, steps=data.fine
        )

    return tuple(on_all_cores(one, data.experiments))
