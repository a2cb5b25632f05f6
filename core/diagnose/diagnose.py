"""The whole diagnosis: from recordings and a model to the missing effects and the error ladder."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..arm.arm import Arm
from ..diagnose.base_fit import BaseFit, fit_base
from ..diagnose.candidates import not_applicable, ruled_out
from ..diagnose.ladder import Ladder, ladder
from ..diagnose.memo import Memo
from ..diagnose.noise_update import against_noise_alone, current_floors
from ..diagnose.progress_messages import LAST, ORDER, fit_title
from ..diagnose.remaining_error import doubts, remaining_error
from ..diagnose.search import Found, LawSearch, Search
from ..diagnose.search_options import Options, RankingCallback
from ..diagnose.stated_results import (
    compare_with_recordings,
    effect_settings,
    final_parameters,
    parameter_origins,
)
from ..effects import catalogue, with_included
from ..errors import InputError
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import converge_precisely, with_simulated_deviations
from ..estimate.problem import FitData
from ..identify.setup import Setup
from ..information_criteria import with_evidence
from ..precompile import precompile_arms
from ..processors import fast_thread_switching
from ..progress import Progress, Silent, Unseen
from ..recording.recording import Recording
from ..results import MISSING, NOTHING, UNJUDGED, UNLISTED, Diagnosis, Doubt, Remains
from ..scenario.schema import IdentifySpec
from ..scenario.stated_effects import candidate_structures
from ..sensors import sensor


@fast_thread_switching()
def diagnose(
    setup: Setup, spec: IdentifySpec, recordings: Sequence[Recording],
    options: Options | None = None, progress: Progress | None = None,
    on_ranking: RankingCallback | None = None, base_fit: BaseFit | None = None,
    on_end: Callable[[BaseFit], None] | None = None, laws: LawSearch | None = None,
) -> Diagnosis:  # fmt: skip
    """Find the effects that the model lacks on the estimation recordings and add them one by one.

    `base_fit`: result of `fit_base_to_recordings` for the same arguments, if there is one; `on_end`
    takes the fit of the model as it stands at the end; `laws` compete with the listed effects where
    more than noise is left. InputError if the recordings lack what the model needs. A stopped
    search keeps what it found.
    """
    options, progress = options or Options(), progress or Silent()
    clock = time.perf_counter()
    base_fit = base_fit or fit_base_to_recordings(setup, spec, recordings, options, progress)
    fitted = time.perf_counter()
    stated = tuple(setup.model.effects)
    memo = Memo(base_fit.validation, stated, base_fit.data.bare.arm.modes)
    base = FittedModel(base_fit.data, base_fit.base, stated)
    search = Search(options, progress, on_ranking, memo, laws)
    found = search.run(base)
    proposal = found.proposal
    progress.stage(ORDER)
    climbed = ladder(found, memo, progress)
    proposed = found.proposed
    if not options.adds:
        climbed, proposed = climbed.as_given(), (*climbed.added, *proposed)
    first, last = climbed.rungs[0].model.with_law_errors, _final(climbed, options, progress)
    climbed = climbed.ending(last)
    final_fit = memo.base_fit(last)
    if on_end is not None:
        on_end(final_fit)
    remaining, base_error = (
        remaining_error(m.data, m.refit.errors, m.refit.problem) for m in (last, first)
    )
    remaining = replace(remaining, over_noise=_tolerated(last, options))
    added, stopped = last.effects[len(stated) :], progress.stopped()
    steps = climbed.steps(memo)
    floors = current_floors(last, options)
    unsure = tuple(doubts(last.data, steps[-1].errors, floors))
    unfinished = stopped and not (proposed or added) and base_error.above
    verdict = UNJUDGED if unfinished else _verdict(bool(proposed or added), base_error, unsure)
    final = _verdict(bool(proposed), remaining, unsure) if options.adds and not stopped else None
    if proposal is not None and (proposal.laws or proposal.events) and not proposed:
        verdict = UNLISTED if verdict == NOTHING else verdict
        final = UNLISTED if final == NOTHING else final
    have = {e.kind for e in with_included(last.effects)}
    reasons = not_applicable(last.data, options.candidates)
    compared = options.compare
    return with_evidence(Diagnosis(
        verdict=verdict, final_verdict=final, rounds=climbed.rounds, steps=steps, doubts=unsure,
        not_applicable={kind: why for kind, why in reasons.items() if kind not in have},
        ruled_out=ruled_out(last.data, options.candidates),
        effects=tuple(effect_settings(last, stated)), floors=last.data.floors,
        seconds={"base": fitted - clock, "diagnose": time.perf_counter() - fitted}, stopped=stopped,
        kept=tuple(e.kind for e in added), needless=_needless(found) if options.adds else (),
        limit=options.max_effects if options.adds else 0,
        error_given=base_error, error_left=remaining,
        given=compare_with_recordings(memo.base_fit(first)) if compared else (),
        left=compare_with_recordings(final_fit) if compared and added else (),
        parameters=final_parameters(last.refit),
        origins=parameter_origins(last.refit), values=last.refit.problem.values(),
        proposed=proposed, shapes=_further_shapes(last, base.data.bare.arm),
        unstated_noise=_unstated_noise(last.data, options.stated_noise),
        noise=climbed.noise.products, proposal=proposal,
    ))  # fmt: skip


def _final(climbed: Ladder, options: Options, progress: Progress) -> FittedModel:
    """The last model, with what is stated of it; at its precise minimum where it leaves no more
    than noise. What a model lacks moves its parameters by far more than a descent's last steps."""
    last = climbed.rungs[-1].model.with_law_errors
    if progress.stopped():
        return last
    progress.stage(LAST)
    data, refit = last.data, last.refit
    if not remaining_error(data, refit.errors).above:
        data, refit = converge_precisely(data, refit, progress.stopped)
    if data.rig.servo:
        refit = with_simulated_deviations(data, refit, options.stated_noise)
    return replace(last, data=data, refit=refit).with_law_errors


def _tolerated(last: FittedModel, options: Options) -> float:
    """What the last model leaves, in noise alone, where a tolerance allows it; else NaN."""
    seen = (against_noise_alone(last, options) or last).with_law_errors
    left = remaining_error(seen.data, seen.refit.errors)
    return left.rms if left.above and not left.beyond_tolerance else float("nan")


def _further_shapes(last: FittedModel, given: Arm) -> tuple[int, ...]:
    """Bending shapes per segment of the model, where they are more than stated."""
    modes = last.data.bare.arm.modes
    return modes if modes != given.modes else ()


def _needless(found: Found) -> tuple[str, ...]:
    """Titles of effects that were added and are no longer in the model."""
    kept = {e.title for e in found.model.effects}
    removed = dict.fromkeys(title for move in found.path for title in move.removed)
    return tuple(title for title in removed if title not in kept)


def _unstated_noise(data: FitData, stated: Mapping[str, float]) -> tuple[str, ...]:
    """Settings of the compared sensors and, where a servo follows them, of the encoders, whose
    noise nobody stated."""
    arm, outputs = data.bare.arm, data.experiments[0].outputs
    followed = (sensor("encoder"),) if data.rig.servo else ()
    return tuple(
        dict.fromkeys(
            s.noise for s in (*outputs, *followed)
            if s.noise and not any(c.name in stated for c in s.channels(arm))
        )
    )  # fmt: skip


def _verdict(more: bool, error: Remains, unsure: Sequence[Doubt]) -> str:
    """The verdict; `more`: whether another effect is known to be missing; `unsure`: why an error
    within the noise says nothing."""
    within = UNJUDGED if unsure else NOTHING
    return MISSING if more else UNLISTED if error.beyond_tolerance else within


@fast_thread_switching()
def fit_base_to_recordings(
    setup: Setup, spec: IdentifySpec, recordings: Sequence[Recording], options: Options,
    progress: Progress,
) -> BaseFit:  # fmt: skip
    """The model fitted with the effects that it has; the search starts there. InputError without a
    recording to estimate from."""
    progress.stage(fit_title(setup.model.effects))
    chosen = [r for r in recordings if r.role == "estimate"]
    if not chosen:
        raise InputError('No recording has role = "estimate"; give at least one to diagnose.')
    candidates = [
        e for kind, e in catalogue().items() if kind in (options.candidates or catalogue())
    ]
    precompile_arms(candidate_structures(setup.model.arm, candidates))
    base_fit = fit_base(
        setup.model, setup.outputs, setup.processing, spec, chosen, options.stated_noise,
        options.fidelity, Unseen(progress), options.identified, options.stated_rig,
    )  # fmt: skip
    unseen = [r for r in recordings if r.role == "validate"]
    validation = base_fit.validation_data(setup.processing, spec, unseen) if unseen else None
    if validation is not None:
        validation = replace(validation, per_recording=options.per_recording)
    return replace(base_fit, validation=validation)
