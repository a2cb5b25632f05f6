"""Validation on sweeps of the second joint: LPV model, rigid arm, non-linear model (Fig. 2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from core.montecarlo.parts.fits import glocal_values
from core.montecarlo.rig import Rig, fit_percent, outputs
from core.montecarlo.settings import StudySettings
from core.montecarlo.study import Answer, Case, Part

SHOWN = 200
"""Points of the path that are kept for its figure."""


class Sweeps(Part):
    """Each with the glocal estimate of another run on noisy data; the sweep itself is clean."""

    kind = "sweeps"
    title = "Validation sweeps"
    order = 2

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        numbers = range(1, settings.sweeps + 1)
        return tuple(Case(self.kind, f"sweeps/{k:03d}", {"sweep": k}) for k in numbers)

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        number, settings = options["sweep"], rig.settings
        run = number  # runs are seeded one by one, so there is a run of every number
        snr = settings.noisy_snr
        values = glocal_values(rig, snr, run)
        recording = rig.recording(settings.sweep(number), f"sweep {number}")
        y = outputs(recording)
        models = {"lpv": rig.model, "rigid": rig.rigid, "nonlinear": rig.truth}
        fits = {}
        for name, model in models.items():
            known = {k: v for k, v in values.items() if k in model.parameters}
            fits[name] = fit_percent(y, rig.predict(model, [recording], known)[0])
        stride = max(len(y) // SHOWN, 1)
        return {
            "sweep": number,
            "run": run,
            "snr_db": snr,
            "EI": rig.stiffness(values),
            "fit": fits,
            "time": recording.time[::stride].tolist(),
            "theta2": recording["theta2"][::stride].tolist(),
        }
