"""Estimation and validation from rigs that are not alike."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding

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
