"""What a recording lacks, or has in common with the scenario's other ones, or not."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...recording.clock import JITTER


class MissingReference(Check):
    """A column that the drive needs and the file does not have."""

    kind = "missing_reference"

    def find(self, case: Case) -> Iterable[Finding]:
        model = case.recording.model
        needed = () if model is None else model.drive.needed_channels(model.arm)
        for name in needed:
            if name not in case.recording.channels:
                sentence = f"column {name} is missing, so the drive cannot be simulated"
                yield case.finding(self.kind, name, 1.0, "", sentence)


class UnequalRates(Check):
    """A sample time that is not that of the scenario's first recording."""

    kind = "unequal_rates"

    def find(self, case: Case) -> Iterable[Finding]:
        own, steps = case.recording.step, [o.recording.step for o in case.others]
        usual = float(np.median(steps)) if steps else own
        if abs(own / usual - 1.0) > JITTER:
            sentence = f"{1 / own:.5g} samples/s where the other recordings have {1 / usual:.5g}"
            yield case.finding(self.kind, "t", own / usual, "", sentence)


class SameData(Check):
    """A validation with the data that was fitted."""

    kind = "same_data"

    def find(self, case: Case) -> Iterable[Finding]:
        own = case.recording
        for other in (o.recording for o in case.others if own.role == "validate"):
            shared = [n for n in own.names("theta#", "z#") if n in other.channels]
            pairs = [(own.channels[n], other.channels[n]) for n in shared]
            same = all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)
            if other.role == "estimate" and pairs and same:
                sentence = f"same data as {other.name}, which is used for estimation: no validation"
                yield case.finding(self.kind, shared[0], 1.0, "", sentence)


LEAST_EXCESS = 0.01
"""Of a channel's variance: what friction at another working point changes is less."""


class DifferentRig(Check):
    """A validation recording that the model fitted to the others does not explain."""

    kind = "different_rig"

    def find(self, case: Case) -> Iterable[Finding]:
        if case.recording.role != "validate" or case.search is None or case.wrong_columns:
            return
        fit = case.search.fit
        fits = [o.search.fit for o in case.others if o.recording.role == "estimate" and o.search]
        known = [f for f in fits if len(f.x) == len(fit.x)]
        if not known:
            return
        usual = np.median([f.x for f in known], axis=0)
        (own,) = fit.of.answers([(fit.recording, usual)])
        others = [f.of.answers([(f.recording, usual)])[0] for f in known]
        apart = {
            e.channel: e for e in own.equations
            if e.excess > LEAST_EXCESS
            and not any(e.is_like(o) for a in others for o in a.of(e.channel))
        }  # fmt: skip
        if len(apart) > 1:  # one alone is a fault of its own
            share = max(e.excess for e in apart.values())
            names = ", ".join(sorted(apart))
            sentence = (
                f"the model of the recordings for estimation leaves {share:.0%} of {names} "
                f"unexplained"
            )
            yield case.finding(self.kind, names.split(",")[0], share, "", sentence)
