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


APART = 0.15
"""|ln| by which gains of two or more relations differ; one alone is a fault of its channel."""
FEWEST = 2
"""Recordings, of which one can differ."""


class DifferentRig(Check):
    """A validation recording whose channels relate to each other in another way."""

    kind = "different_rig"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        if case.recording.role != "validate" or case.suspects or case.causes:
            return
        judged = [o for o in case.others if o.recording.role == "estimate"]
        if not judged:
            return
        changes: dict[str, float] = {}
        for relation in case.dynamics.relations:
            usual = [
                np.log(abs(r.gain)) for o in judged for r in o.dynamics.relations
                if r.key == relation.key and r.explained > 0.9
            ]  # fmt: skip
            if len(usual) and relation.explained > 0.7:
                spread = float(np.ptp(usual)) if len(usual) > 1 else 0.0
                change = float(np.log(abs(relation.gain)) - np.median(usual))
                if abs(change) > APART + spread:
                    changes[relation.output] = change
        if len(changes) >= FEWEST:
            size = max(np.exp(abs(c)) for c in changes.values())
            names = ", ".join(sorted(changes))
            sentence = f"{names} respond up to {size:.3g} times as strongly as for estimation"
            yield case.finding(self.kind, names.split(",")[0], size, "", sentence)
