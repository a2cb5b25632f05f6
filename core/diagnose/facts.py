"""What a fitted model says of its parameters: their sizes, and what each belongs to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.diagnose.data import Data
from core.diagnose.refit import Refit, robust_covariance
from core.diagnose.steps import estimates
from core.identify import identifiability
from core.identify.estimates import derived_estimates
from core.identify.uncertainty import BY_DIFFERENCES
from core.least_squares import whole
from core.results import Estimate


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
    known = robust_covariance(refit, BY_DIFFERENCES, released=True)
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
