"""Where a round's best effect has a competitor: the experiments that would decide."""

from __future__ import annotations

from collections.abc import Sequence

from core.diagnose.acceptance import Round
from core.diagnose.data import Data
from core.diagnose.next_experiment import next_experiments
from core.diagnose.planned import possible
from core.progress import Progress
from core.results import PlannedExperiment, RankedEffect


def deciding(
    found: Round, ranking: Sequence[RankedEffect], data: Data, progress: Progress
) -> tuple[PlannedExperiment, ...]:
    """Best first; none where nothing was found or nothing competes with it."""
    best = found.accepted
    if best is None:
        return ()
    named = next(r for r in ranking if r.effect == best.screened.effect.kind)
    competitors = [w for w in found.weighed if w.screened.effect.kind in named.confused_with[:1]]
    specs = possible(data)
    if not competitors or not specs:
        return ()
    progress.advance(0, "Planning the experiment that would decide")
    return next_experiments(
        data, best.refit.hypothesis, competitors[0].refit.hypothesis,
        (named.title, competitors[0].screened.effect.title), specs, progress.stopped,
    )  # fmt: skip
