"""The whole diagnosis: from recordings and a model to what is missing and how the error fell."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from core.diagnose.announce import round_title
from core.diagnose.data import Data
from core.diagnose.deciding import deciding
from core.diagnose.describe import ranking_of
from core.diagnose.facts import sizes_of, titles_of
from core.diagnose.ladder import REFITTED, Round, applicable, not_applicable, one_round
from core.diagnose.prune import without_needless
from core.diagnose.refit import Refit
from core.diagnose.screen import Screen
from core.diagnose.start import Begun, begin
from core.diagnose.steps import ladder_step
from core.diagnose.verdict import MISSING, NOTHING, UNLISTED, remains
from core.diagnose.words import Told, say
from core.effects.effect import Effect
from core.errors import InputError
from core.identify.setup import Setup
from core.progress import Progress, Silent
from core.recording.recording import Recording
from core.results import Diagnosis, DiagnosisRound, LadderStep, RankedEffect
from core.scenario.schema import IdentifySpec

FIDELITY = 0.001
"""Share of a channel's spread that no model is asked to explain where nothing else is stated."""


@dataclass(frozen=True)
class Options:
    """How far to look."""

    max_effects: int = 3
    candidates: tuple[str, ...] = ()
    """Ids to choose from; empty: all that apply."""
    fidelity: float = FIDELITY
    stated_noise: Mapping[str, float] = field(default_factory=dict)
    """channel -> standard deviation of the sensor's noise, SI, where it is known."""
    per_recording: tuple[str, ...] = ()
    """Effects whose sizes are estimated anew on validation data (another bench's friction)."""


Listener = Callable[[tuple[RankedEffect, ...]], None]
"""Called with the ranking as it stands: after the screen, after each refit."""


@dataclass
class _State:
    """What the ladder has so far."""

    data: Data
    refit: Refit
    present: list[Effect]
    rounds: list[DiagnosisRound]
    steps: list[LadderStep]
    validation: Data | None


def diagnose(
    setup: Setup,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    options: Options | None = None,
    progress: Progress | None = None,
    listen: Listener = lambda _: None,
) -> Diagnosis:
    """Names what the model lacks on the estimation recordings, and adds it step by step.

    InputError where the recordings lack what the model needs. Stopping keeps what was found.
    """
    options, progress = options or Options(), progress or Silent()
    clock = time.perf_counter()
    progress.stage("Fitting the model as it is")
    begun = _begin(setup, spec, recordings, options, progress)
    state = _state(setup, spec, recordings, begun, options)
    fitted = time.perf_counter()
    last = _climb(state, options, progress, listen)
    kept, removed = without_needless(
        state.data, state.refit, state.present, setup.model.effects, progress.stopped
    )
    if removed:
        state.refit, state.present = kept.refit, list(kept.effects)
        names = [e.title for e in removed]
        state.steps.append(_step(state, None, "Without: " + ", ".join(names)))
    given = remains(begun.data.experiments, begun.base.errors)
    left = remains(state.data.experiments, state.refit.errors)
    found = [e for e in state.present if e not in setup.model.effects]
    verdict = MISSING if last.accepted or found else (UNLISTED if given.above else NOTHING)
    final = None if not options.max_effects else _final(last, left.above, len(found), options)
    applies = not_applicable(state.data, options.candidates)
    told = Told(
        verdict, final, state.rounds, state.steps, given, left, applies,
        kept=[e.kind for e in found], limit=options.max_effects, titles=titles_of(state.refit),
        sizes=sizes_of(found, state.refit, state.data), stopped=progress.stopped(),
    )  # fmt: skip
    return Diagnosis(
        verdict=verdict,
        final_verdict=final,
        rounds=tuple(state.rounds),
        steps=tuple(state.steps),
        words=say(told),
        not_applicable=applies,
        effects=tuple(_settings(found, state.refit)),
        floors=state.data.floors,
        seconds={"base": fitted - clock, "diagnose": time.perf_counter() - fitted},
        notes=(),
    )


def _final(last: Round, above: bool, found: int, options: Options) -> str:
    if last.accepted is not None and found >= options.max_effects and above:
        return UNLISTED
    if last.accepted is not None and above:
        return MISSING
    return UNLISTED if above else NOTHING


def _begin(
    setup: Setup,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    options: Options,
    progress: Progress,
) -> Begun:
    chosen = [r for r in recordings if r.role == "estimate"]
    if not chosen:
        raise InputError('No recording has role = "estimate"; give at least one to diagnose.')
    return begin(
        setup.model, setup.outputs, setup.processing, spec, chosen, options.stated_noise,
        options.fidelity, progress.stopped,
    )  # fmt: skip


def _state(
    setup: Setup,
    spec: IdentifySpec,
    recordings: Sequence[Recording],
    begun: Begun,
    options: Options,
) -> _State:
    later = [r for r in recordings if r.role == "validate"]
    validation = begun.for_others(setup.processing, spec, later) if later else None
    if validation is not None:
        validation = replace(validation, per_recording=options.per_recording)
    state = _State(begun.data, begun.base, list(setup.model.effects), [], [], validation)
    state.steps.append(_step(state, None, "The model as given"))
    return state


def _step(state: _State, added: Effect | None, title: str) -> LadderStep:
    names: tuple[str, ...] = ()
    if added is not None:
        own = added.knobs(state.refit.hypothesis.model.arm, state.data.bare.drive, state.data.sizes)
        names = tuple(k.parameter.name for k in own) or ("",)
    kind = None if added is None else added.kind
    return ladder_step(state.data, state.validation, state.refit, kind, title, names)


def _climb(state: _State, options: Options, progress: Progress, listen: Listener) -> Round:
    """Rounds until nothing is accepted; the last one looked at, whether it found or not."""
    while True:
        candidates = applicable(state.data, state.present, options.candidates)
        arm = state.refit.hypothesis.model.arm
        title = round_title(len(state.rounds) + 1, arm, candidates)
        progress.stage(title, len(candidates) + REFITTED)
        found = _round(state, candidates, progress, listen)
        accepted = found.accepted if len(state.steps) <= options.max_effects else None
        kind = None if accepted is None else accepted.screened.effect.kind
        ranking = ranking_of(found, state.data)
        planned = deciding(found, ranking, state.data, progress)
        sentence = planned[0].sentence if planned else ""
        state.rounds.append(DiagnosisRound(ranking, kind, sentence, planned))
        state.refit = found.after if accepted is not None else found.before
        if accepted is None:
            return replace(found, accepted=found.accepted)
        added = accepted.screened.effect
        state.present.append(added)
        state.steps.append(_step(state, added, added.title))
        if len(state.steps) > options.max_effects or progress.stopped():
            return found


def _round(
    state: _State, candidates: Sequence[Effect], progress: Progress, listen: Listener
) -> Round:
    def told(text: str) -> bool:
        if text:
            progress.advance(text=text)
        return progress.stopped()

    def screened(seen: Screen) -> None:
        empty = Round(seen, (), None, state.refit, state.refit)
        listen(ranking_of(empty, state.data))

    return one_round(
        state.data, state.refit, state.present, candidates, told, screened,
        lambda partial: listen(ranking_of(partial, state.data)),
    )  # fmt: skip


def _settings(found: Sequence[Effect], refit: Refit) -> list[dict[str, object]]:
    """The accepted effects as [model] effects of a scenario."""
    model, values = refit.hypothesis.model, refit.hypothesis.values()
    known = {**model.effect_values, **values}
    listed: list[dict[str, object]] = []
    for one in found:
        from core.effects.sizes import typical

        knobs = one.knobs(model.arm, model.drive, typical(model.arm))
        entry: dict[str, object] = {"id": one.kind}
        for knob in knobs:
            name = knob.parameter.name
            entry[name] = {"start": float(known.get(name, knob.parameter.value)), "vary": True}
        listed.append(entry)
    return listed
