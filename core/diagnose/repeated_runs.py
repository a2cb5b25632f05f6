"""What the fits of one scenario say about its repeated runs."""

from __future__ import annotations

from collections.abc import Sequence

from core.diagnose.repetition import repeated
from core.identify.fit import Fitted
from core.identify.repeatability import repeatability
from core.results import Estimate, Repeated


def runs_compared(fits: Sequence[Fitted]) -> tuple[Repeated, ...]:
    """Parameters over the recordings that repeat one another, where each has estimates of its own:
    by local fits, or by `per_recording`. Nothing where fewer than three do."""
    experiments = [e for f in fits for e in f.residuals.experiments]
    own = _own_estimates(fits)
    found: list[Repeated] = []
    for group in repeated(experiments):
        names = [experiments[s.recording].recording.name for s in group.stretches]
        runs = {name: own[name] for name in names if own.get(name)}
        if len(runs) == len(names) == len(set(names)):
            found += repeatability(runs)
    return tuple(found)


def _own_estimates(fits: Sequence[Fitted]) -> dict[str, list[Estimate]]:
    own: dict[str, list[Estimate]] = {}
    for f in fits:
        alone = f.fit.recordings[0] if len(f.fit.recordings) == 1 and len(fits) > 1 else None
        for e in f.fit.estimates:
            run = e.recording or alone
            if run is not None:
                own.setdefault(run, []).append(e)
    return own
