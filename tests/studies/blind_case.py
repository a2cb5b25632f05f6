"""One blind case: data are made, the diagnosis is asked, its answer is compared with the truth."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.diagnose.diagnose import diagnose
from core.diagnose.state import Options
from core.effects import effect, with_included
from core.identify.setup import make_setup
from core.model import Model
from core.recording.recording import Recording
from core.results import Diagnosis
from core.study.detectability import Detectability, UnreachableError
from core.study.hidden import Hidden, added, hidden, parameters_on
from core.study.rig import IDENTIFY, STDS, bare_model, exactly, noisy, readings, recording
from tests.studies.blind_cases import LEVELS, Case
from tests.studies.blind_run import record_text
from tests.studies.outside import disturbed

COVERED = 1.96
"""Standard deviations of the interval in which 95 % of the truths should lie."""

TOP = 5
"""Candidates of the first ranking that are kept."""


@dataclass(frozen=True)
class Made:
    """Recordings without noise, the model that lacks something, and the truth."""

    model: Model
    recordings: Sequence[Recording]
    truth: Mapping[str, float]
    sizes: Mapping[str, tuple[str, ...]]
    """Hidden effect -> names of its sizes."""
    shown: Mapping[str, float]
    """What each hidden thing shows, in noise rms per sample."""


def made(case: Case) -> Made:
    """The data of a case; UnreachableError where no size shows what was asked for."""
    return _MAKERS[case.part](case)


def answer_text(order: str) -> str:
    """The record of the case that a worker is sent."""
    return record_text(order, _case, run_case)


def _case(what: Sequence[str], **fields: Any) -> Case:
    """Of what JSON made of one: a list for the tuple."""
    return Case(what=tuple(what), **fields)


def run_case(case: Case, max_effects: int = 3) -> dict[str, Any]:
    """A record of plain values: what was hidden, what was said, how right it was."""
    record: dict[str, Any] = {
        "key": case.key, "part": case.part, "what": list(case.what), "level": case.level,
        "seed": case.seed, "noise": case.noise,
    }  # fmt: skip
    clock = time.process_time()
    try:
        data = made(case)
    except UnreachableError as error:
        return {**record, "unreachable": str(error)}
    recordings, floor = noisy(data.recordings, case.noise, case.stream)
    ready = time.process_time()
    known = tuple(data.model.effect_parameters)  # believed only roughly, so they are estimated
    spec = IDENTIFY.model_copy(update={"parameters": (*IDENTIFY.parameters, *known)})
    setup = make_setup(data.model, spec, recordings)
    options = Options(max_effects=max_effects, stated_noise=STDS, compare=False)
    answer = diagnose(setup, spec, recordings, options)
    record |= {
        "truth": dict(data.truth), "shown": dict(data.shown), "noise_mean_square": floor,
        "known": [e.kind for e in data.model.effects],
        "seconds": {"data": ready - clock, "diagnose": time.process_time() - ready},
    }  # fmt: skip
    return record | answer_record(answer) | compared(answer, data, case.what)


def answer_record(answer: Diagnosis) -> dict[str, Any]:
    """What the diagnosis said, without the arrays."""
    top = answer.ranking[:TOP]
    return {
        "verdict": answer.verdict,
        "final_verdict": answer.final_verdict,
        "accepted": [s.added for s in answer.steps if s.added is not None],
        "cost": [s.cost_per_sample for s in answer.steps],
        "group": list(top[0].confused_with) if top else [],
        "top": [
            [r.effect, r.score, r.refit_drop_percent, r.delta_bic, r.expected_drop_percent]
            for r in top
        ],
        "rounds": [[r.accepted, [x.effect for x in r.ranking[:3]]] for r in answer.rounds],
    }


def compared(answer: Diagnosis, data: Made, what: Sequence[str]) -> dict[str, Any]:
    """How right it was."""
    order = [r.effect for r in answer.ranking]
    first = answer.ranking[0] if answer.ranking else None
    named = {} if first is None else {first.effect, *first.confused_with}
    ranks = {kind: order.index(kind) + 1 if kind in order else None for kind in what}
    found = _found(answer)
    return {
        "ranks": ranks,
        "first": bool(first and first.effect in what),
        "in_group": bool(set(what) & set(named)),
        "took": bool(answer.rounds and answer.rounds[0].accepted),
        "named": {kind: kind in found for kind in what},
        "sizes": _sizes(answer, data),
    }


def _found(answer: Diagnosis) -> set[str]:
    """All that is in the model at the end, with what the data cannot tell from it.

    What an accepted effect includes is not named by it.
    """
    last = [effect(kind) for kind in answer.steps[-1].model]
    found = {e.kind for e in last} - {kind for e in last for kind in e.includes}
    for each in answer.rounds:
        if each.accepted in found:
            winner = next(r for r in each.ranking if r.effect == each.accepted)
            found |= set(winner.confused_with)
    return found


def _sizes(answer: Diagnosis, data: Made) -> dict[str, dict[str, float]]:
    """name -> truth, estimate, deviation, of the sizes after the step that added their effect."""
    found: dict[str, dict[str, float]] = {}
    for step in answer.steps:
        names = data.sizes.get(step.added or "", ())
        for e in step.parameters:
            if e.name in names:
                found[e.name] = {"truth": data.truth[e.name], "value": e.value, "std": e.std}
    return found


def _recordings(case: Case, model: Model, outputs: Sequence[np.ndarray] | None = None):  # type: ignore[no-untyped-def]
    found = []
    for i, e in enumerate(case.experiments()):
        task = e.task(model)
        clean = readings(model, exactly(model, task)) if outputs is None else outputs[i]
        found.append(recording(e, task, model, clean))
    return found


def _bare(case: Case) -> Model:
    return bare_model()


def _as_believed(h: Hidden) -> Model:
    """The model that is diagnosed: what is known before is in it, at plausible sizes."""
    return h.base.bare.with_effects(h.base.effects, {}, h.sizes) if h.base.bare else h.base


def _names(kind: str, model: Model) -> tuple[str, ...]:
    return tuple(k.parameter.name for k in parameters_on(effect(kind), model) if not k.secondary)


def _single(case: Case) -> Made:
    one = effect(case.what[0])
    rng = np.random.default_rng(case.stream)
    level = LEVELS.get(case.level, np.nan)
    h = hidden(one, _bare(case), case.experiments(), level, rng)
    truth = {**h.base.effect_values, **h.values}
    names = {one.kind: _names(one.kind, h.base)}
    recordings = _recordings(case, h.truth)
    return Made(_as_believed(h), recordings, truth, names, {one.kind: h.level})


def _pair(case: Case) -> Made:
    """Both at the size that shows the level alone; what either needs before is in the model."""
    rng = np.random.default_rng(case.stream)
    each = [
        hidden(effect(k), _bare(case), case.experiments(), LEVELS[case.level], rng)
        for k in case.what
    ]
    known = with_included([e for h in each for e in h.base.effects])
    truth: dict[str, float] = {}
    for h in each:
        truth |= h.base.effect_values
    for h in each:
        truth |= h.values
    bare, sizes = _bare(case), each[0].sizes
    base = bare.with_effects(known, truth, sizes)
    model = added(base, [effect(k) for k in case.what], truth, sizes)
    believed = bare.with_effects([e for e in known if e.kind not in case.what], {}, sizes)
    names = {k: _names(k, base) for k in case.what}
    shown = {h.kind: h.level for h in each}
    return Made(believed, _recordings(case, model), truth, names, shown)


def _null(case: Case) -> Made:
    return Made(_bare(case), _recordings(case, _bare(case)), {}, {}, {})


def _outside(case: Case) -> Made:
    detectability = Detectability(_bare(case), case.experiments())
    rng = np.random.default_rng(case.stream)
    found = disturbed(case.what[0], detectability, LEVELS[case.level], rng)
    recordings = _recordings(case, _bare(case), found.outputs)
    return Made(_bare(case), recordings, found.figures, {}, {case.what[0]: found.level})


_MAKERS = {"singles": _single, "pairs": _pair, "nulls": _null, "outside": _outside}
