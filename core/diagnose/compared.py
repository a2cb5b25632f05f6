"""Measured against the fit that a diagnosis looks at: what its ladder counts, sample by sample."""

from __future__ import annotations

from dataclasses import replace

from core.diagnose.data import Data, Hypothesis
from core.diagnose.missing_torque import missing_torque
from core.diagnose.start import Begun
from core.identify.compare import compare
from core.identify.predictor import on_all_cores
from core.identify.prepared import Prepared
from core.results import RecordingComparison
from core.results.comparison import DIAGNOSIS_FIT


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
