"""A time column that runs too fast or too slow."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding
from core.check.relations import relations

FACTORS = (0.1, 0.2, 0.25, 0.4, 0.5, 2.0, 2.5, 4.0, 5.0, 10.0)
"""Wrong sample times are slips of rates: 1 and 2 kHz, 100 and 250 Hz, a decimal."""
GOOD, BAD = 0.9, 0.75
"""Share of the encoders' variance explained with the right clock, and with a wrong one; elastic
joints leave 0.78 with the right one (scenarios/mujoco)."""


def clock_speed(case: Case) -> tuple[float, float, float] | None:
    """(stated over true sample time, share explained with the true one, and as stated)."""
    found = case.recording
    if found.model is None or case.misfits:
        return None
    before = _explained(case)
    if before is None or before > BAD:
        return None
    best = (0.0, 1.0)
    for factor in FACTORS:
        other = Case(replace(found, time=found.time / factor))
        score = _explained(other)
        if score is not None and score > best[0]:
            best = (score, factor)
    return (best[1], best[0], before) if best[0] > max(GOOD, before + 0.1) else None


def _explained(case: Case) -> float | None:
    """The mean over the encoders, at gains near one; a gain far from one explains nothing."""
    made = [r for r in relations(case.recording, quick=True) if r.output.startswith("theta")]
    loops = [r for r in made if len(r.inputs) == len(case.recording.names("theta#"))]
    loops = [r for r in loops if r.inputs[0].startswith("d")]
    if not loops:
        return None
    return float(np.mean([r.explained if 0.7 < r.gain < 1.4 else 0.0 for r in loops]))


class SampleTime(Check):
    """The loop's motion fits only with another sample time."""

    kind = "sample_time"

    def look(self, case: Case) -> Iterable[Finding]:
        found = clock_speed(case)
        if found is None:
            return
        factor, explained, before = found
        step = case.recording.step / factor
        said = (
            f"the motion fits the references with {step:.4g} s per row ({explained:.1%} explained) "
            f"instead of {case.recording.step:.4g} s ({max(before, 0.0):.1%})"
        )
        mend = case.column("t", gain=f"{1.0 / factor:.6g}")
        yield case.finding(self.kind, "t", factor, "", said, mend)
