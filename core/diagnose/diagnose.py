"""The whole diagnosis: from recordings and a model to the missing effects and the error ladder."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..diagnose.base_fit import BaseFit, fit_base
from ..diagnose.effect_search import converge_final_model
from ..diagnose.final_ladder import final_ladder
from ..diagnose.final_results import compare_with_recordings, final_parameters, parameter_origins
from ..diagnose.fit_problem import Data
from ..diagnose.noise_floor_update import search_with_new_floors
from ..diagnose.progress_messages import fit_title
from ..diagnose.remaining_error import remaining_error
from ..diagnose.search_round import not_applicable, ruled_out
from ..diagnose.search_state import (
    Options,
    RankingCallback,
    added_effect_settings,
    state_from_base_fit,
)
from ..effects import catalogue, with_included
from ..errors import InputError
from ..identify.predictor import fast_thread_switching
from ..identify.setup import Setup
from ..precompile import precompile_arms
from ..progress import Progress, Silent
from ..recording.recording import Recording
from ..results import MISSING, NOTHING, UNLISTED, Diagnosis, Remains
from ..scenario.schema import IdentifySpec
from ..scenario.stated_effects import candidate_structures
from ..sensors import sensor


@fast_thread_switching()
def diagnose(
    setup: Setup, spec: IdentifySpec, recordings: Sequence[Recording],
    options: Options | None = None, progress: Progress | None = None,
    on_ranking: RankingCallback | None = None, base_fit: BaseFit | None = None,
    on_end: Callable[[BaseFit], None] | None = None,
) -> Diagnosis:  # fmt: skip
    """Finds the effects that the model lacks on the estimation recordings and adds them one by one.

    `base_fit`: result of `fit_base_to_recordings` for the same arguments, if there is one; `on_end`
    takes the final fit. InputError if the recordings lack what the model needs. A stopped search
    keeps what it found.
    """
    options, progress = options or Options(), progress or Silent()
    clock = time.perf_counter()
    base_fit = base_fit or fit_base_to_recordings(setup, spec, recordings, options, progress)
    state = state_from_base_fit(setup, base_fit)
    fitted = time.perf_counter()
    state, more = search_with_new_floors(state, options, progress, on_ranking)
    state, base_fit = final_ladder(state, base_fit, options, progress)
    converge_final_model(state, options, progress)
    final_fit = BaseFit(
        state.data, state.refit, state.validation, state.validation_fit(state.refit)
    )
    base_fit = base_fit if state.added else final_fit
    if on_end is not None:
        on_end(final_fit)
    remaining = remaining_error(state.data, state.refit.errors, state.refit.hypothesis)
    base_error = remaining_error(base_fit.data, base_fit.base.errors, base_fit.base.hypothesis)
    stopped = progress.stopped()
    verdict = _verdict(bool(more or state.added or (stopped and base_error.above)), base_error)
    final = _verdict(more, remaining) if options.max_effects and not stopped else None
    have = {e.kind for e in with_included(state.present)}
    reasons = not_applicable(state.data, options.candidates)
    applies = {kind: reason for kind, reason in reasons.items() if kind not in have}
    return Diagnosis(
        verdict=verdict, final_verdict=final, rounds=tuple(state.rounds), steps=tuple(state.ladder),
        not_applicable=applies, ruled_out=ruled_out(state.data, options.candidates),
        effects=tuple(added_effect_settings(state)), floors=state.data.floors,
        seconds={"base": fitted - clock, "diagnose": time.perf_counter() - fitted}, stopped=stopped,
        kept=tuple(e.kind for e in state.added), needless=state.needless, limit=options.max_effects,
        error_given=base_error, error_left=remaining,
        given=compare_with_recordings(base_fit) if options.compare else (),
        left=compare_with_recordings(final_fit) if options.compare and state.added else (),
        parameters=final_parameters(state.refit),
        origins=parameter_origins(state.refit), values=state.refit.hypothesis.values(),
        unstated_noise=_unstated_noise(state.data, options.stated_noise),
    )  # fmt: skip


def _unstated_noise(data: Data, stated: Mapping[str, float]) -> tuple[str, ...]:
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


def _verdict(more: bool, error: Remains) -> str:
    """The verdict; `more`: whether another effect is known to be missing."""
    return MISSING if more else UNLISTED if error.above else NOTHING


@fast_thread_switching()
def fit_base_to_recordings(
    setup: Setup, spec: IdentifySpec, recordings: Sequence[Recording], options: Options,
    progress: Progress,
) -> BaseFit:  # fmt: skip
    """The model fitted with the effects that it has; the search starts there."""
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
        options.fidelity, progress.stopped, options.identified, options.stated_rig,
    )  # fmt: skip
    unseen = [r for r in recordings if r.role == "validate"]
    validation = base_fit.validation_data(setup.processing, spec, unseen) if unseen else None
    if validation is not None:
        validation = replace(validation, per_recording=options.per_recording)
    return replace(base_fit, validation=validation)
