"""The whole diagnosis: from recordings and a model to what is missing and how the error fell."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from ..diagnose.base_fit import Begun, begin
from ..diagnose.effect_search import settle
from ..diagnose.final_ladder import final_ladder
from ..diagnose.final_results import compared, final_parameters, origins
from ..diagnose.noise_floor_update import search_with_new_floors
from ..diagnose.progress_messages import fit_title
from ..diagnose.remaining_error import remains
from ..diagnose.search_round import not_applicable, ruled_out
from ..diagnose.search_state import Options, RankingCallback, begun_state, settings
from ..effects import catalogue, with_included
from ..errors import InputError
from ..identify.predictor import quick_handover
from ..identify.setup import Setup
from ..progress import Progress, Silent
from ..recording.recording import Recording
from ..results import MISSING, NOTHING, UNLISTED, Diagnosis, Remains
from ..scenario.schema import IdentifySpec
from ..scenario.stated_effects import structures_tried
from ..warm import compile_beforehand


@quick_handover()
def diagnose(
    setup: Setup,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    options: Options | None = None,
    progress: Progress | None = None,
    on_ranking: RankingCallback | None = None,
    begun: Begun | None = None,
    on_end: Callable[[Begun], None] | None = None,
) -> Diagnosis:
    """Names what the model lacks on the estimation recordings, and adds it step by step.

    `begun`: what `begin_on` gave for the same arguments, where it was asked before; `on_end` takes
    the fit that all of the answer is of. InputError where the recordings lack what the model needs.
    Stopping keeps what was found.
    """
    options, progress = options or Options(), progress or Silent()
    clock = time.perf_counter()
    begun = begun or begin_on(setup, spec, recordings, options, progress)
    state = begun_state(setup, begun)
    fitted = time.perf_counter()
    state, more = search_with_new_floors(state, options, progress, on_ranking)
    state, begun = final_ladder(state, begun, options, progress)
    settle(state, options, progress)
    last = Begun(state.data, state.refit, state.validation, state.validated(state.refit))
    begun = begun if state.found else last
    if on_end is not None:
        on_end(last)
    left = remains(state.data, state.refit.errors, state.refit.hypothesis)
    given = remains(begun.data, begun.base.errors, begun.base.hypothesis)
    stopped = progress.stopped()
    verdict = _verdict(bool(more or state.found or (stopped and given.above)), given)
    final = _verdict(more, left) if options.max_effects and not stopped else None
    have = {e.kind for e in with_included(state.present)}
    reasons = not_applicable(state.data, options.candidates)
    applies = {kind: reason for kind, reason in reasons.items() if kind not in have}
    return Diagnosis(
        verdict=verdict,
        final_verdict=final,
        rounds=tuple(state.rounds),
        steps=tuple(state.steps),
        not_applicable=applies,
        ruled_out=ruled_out(state.data, options.candidates),
        effects=tuple(settings(state)),
        floors=state.data.floors,
        seconds={"base": fitted - clock, "diagnose": time.perf_counter() - fitted},
        stopped=stopped,
        kept=tuple(e.kind for e in state.found),
        needless=state.detours,
        limit=options.max_effects,
        error_given=given,
        error_left=left,
        given=compared(begun) if options.compare else (),
        left=compared(last) if options.compare and state.found else (),
        parameters=final_parameters(state.refit),
        origins=origins(state.refit, state.data),
        values=state.refit.hypothesis.values(),
    )


def _verdict(more: bool, of: Remains) -> str:
    """`more`: whether an effect is known to be missing."""
    return MISSING if more else UNLISTED if of.above else NOTHING


@quick_handover()
def begin_on(
    setup: Setup,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    options: Options,
    progress: Progress,
) -> Begun:
    """The model fitted as it is, where the search begins."""
    progress.stage(fit_title(setup.model.effects))
    chosen = [r for r in recordings if r.role == "estimate"]
    if not chosen:
        raise InputError('No recording has role = "estimate"; give at least one to diagnose.')
    tried = [e for kind, e in catalogue().items() if kind in (options.candidates or catalogue())]
    compile_beforehand(structures_tried(setup.model.arm, tried))
    begun = begin(
        setup.model, setup.outputs, setup.processing, spec, chosen, options.stated_noise,
        options.fidelity, progress.stopped, options.identified, options.stated_rig,
    )  # fmt: skip
    later = [r for r in recordings if r.role == "validate"]
    validation = begun.for_others(setup.processing, spec, later) if later else None
    if validation is not None:
        validation = replace(validation, per_recording=options.per_recording)
    return replace(begun, validation=validation)
