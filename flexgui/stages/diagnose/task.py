"""Diagnose one version of the model: how well it fits, and what could be missing in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flexgui.core.effects import catalogue
from flexgui.core.progress import Unseen
from flexgui.core.results import LadderStep, Outcome, RankedEffect, RecordingComparison
from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.stated_effects import (
    base_model,
    candidate_effects,
    with_effect_parameters,
    without_diagnosis,
)
from flexgui.sentences.ranked import in_order
from flexgui.stages.diagnose.model_versions import ModelFindings, PartialProgress
from flexgui.views.over_speed import OverSpeed, over_speed

if TYPE_CHECKING:
    from flexgui.core.diagnose.base_fit import BaseFit
    from flexgui.core.diagnose.search_options import Options, RemainingTrials
    from flexgui.core.identify.setup import Setup
    from flexgui.core.model import Model
    from flexgui.core.recording.recording import Recording
    from flexgui.core.scenario.schema import IdentifySpec, Scenario


LOOKED, COMPARED = "looked", "compared"
"""The names of what is streamed: the growing findings, and once measured against modelled."""

BEFORE, AFTER = "before", "after"
"""When the identification is done: after an effect was added, its fit is what is waited for."""

MOST_ROWS = 1000
"""Of a recording's residual that a picture is drawn of."""

PICTURED = 10
"""Effects whose predictions are kept, the best."""


class SearchInputs(NamedTuple):
    """What is looked at, and how far."""

    recordings: list[Recording]
    setup: Setup
    spec: IdentifySpec
    options: Options


def diagnose(
    scenario: Scenario,
    folder: str | None = None,
    fit: str = "",
    identified: Mapping[str, float] | None = None,
    *,
    progress: PartialProgress,
) -> ModelFindings:
    """What is missing in the scenario's model, with nothing added to it.

    `identified`: label -> estimate, a start of the first fit; `fit`: also identify, from where the
    parameters start, "before" or "after" the search. The step of the error ladder is reported
    first; then the ranking, again and again as it gets finer.
    """
    from flexgui.core.diagnose.diagnose import diagnose as search
    from flexgui.core.propose.competition import LAWS

    where = ConfinedFolder(Path(folder or "."))
    inputs = _search_inputs(scenario, identified or {}, where, progress)
    reporter = FindingsReporter(inputs, progress)
    if fit == BEFORE and not progress.stopped():
        reporter.check()
        reporter.report(outcome=refined(scenario, where, progress))

    def on_ranking(ranking: tuple[RankedEffect, ...], to_come: RemainingTrials) -> None:
        sizes, effects = to_come
        shown = thinned(ranking, reporter.counted)
        reporter.report(ranking=shown, to_come=sizes, untried=effects)
        if not sizes:
            reporter.check()

    found = search(
        inputs.setup, inputs.spec, inputs.recordings, inputs.options, progress, on_ranking,
        reporter.fitted, reporter.settled, LAWS if scenario.diagnose.propose else None,
    )  # fmt: skip
    first = next(iter(found.proposed), None)
    light = tuple(
        replace(r, ranking=thinned(r.ranking, reporter.counted, first)) for r in found.rounds
    )
    reported = replace(found, rounds=light)
    step = replace(reporter.seen.step, left=found.steps[0].left)
    reporter.report(step=step, ranking=reported.ranking, diagnosis=reported)
    if fit == AFTER and not progress.stopped():
        return replace(reporter.seen, outcome=refined(scenario, where, progress))
    return reporter.seen


def propose_laws(
    scenario: Scenario,
    folder: str | None = None,
    identified: Mapping[str, float] | None = None,
    found: ModelFindings | None = None,
    *,
    progress: PartialProgress,
) -> ModelFindings:
    """What was found with laws for what the scenario's model leaves, whatever the verdict."""
    from flexgui.core.diagnose.diagnose import fit_base_to_recordings
    from flexgui.core.information_criteria import with_evidence
    from flexgui.core.propose.propose import propose

    assert found is not None
    assert found.diagnosis is not None
    where = ConfinedFolder(Path(folder or "."))
    recordings, setup, spec, options = _search_inputs(scenario, identified or {}, where, progress)
    fitted = fit_base_to_recordings(setup, spec, recordings, options, progress)
    proposal = propose(fitted, options, progress)
    return replace(found, diagnosis=with_evidence(replace(found.diagnosis, proposal=proposal)))


def _search_inputs(
    scenario: Scenario, identified: Mapping[str, float], where: ConfinedFolder,
    progress: PartialProgress,
) -> SearchInputs:  # fmt: skip
    from flexgui.core.diagnose.search_options import DEFAULT_EFFECTS, Options
    from flexgui.core.identify.setup import make_setup
    from flexgui.core.loading import load_recordings
    from flexgui.core.noise.output_noise import stated_noise

    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    settings = scenario.diagnose
    candidate_effects(settings)  # a slip there is reported before the long work
    if settings.output is not None:
        spec = spec.model_copy(update={"output": settings.output})
    progress.stage("Reading the recordings", len(scenario.recordings))
    recordings = list(load_recordings(scenario, model, where, None, progress))
    setup = make_setup(model, spec, recordings)
    options = Options(
        max_effects=settings.max_effects or DEFAULT_EFFECTS,
        adds=False,
        compare=False,  # the reporter does it sooner
        candidates=settings.candidates or (),
        fidelity=settings.fidelity,
        stated_noise=stated_noise(scenario, setup, recordings),
        per_recording=settings.per_recording,
        stated_rig=scenario.rig.statements,
        identified=identified,
    )
    return SearchInputs(recordings, setup, spec, options)


class FindingsReporter:
    """The model fitted as it is: its step of the ladder and what it leaves of the recordings, sent
    at once; what else is found comes with them."""

    def __init__(self, inputs: SearchInputs, progress: PartialProgress) -> None:
        from flexgui.core.diagnose.diagnose import fit_base_to_recordings

        self._progress = progress
        recordings, setup, spec, options = inputs
        self._whole = fit_base_to_recordings(setup, spec, recordings, options, progress)
        self._checked = False
        self._shown: tuple[RecordingComparison, ...] = ()
        self._best: object = None
        at_once = replace(self._whole, validation=None)  # that takes longer
        self.counted = [e.counted for e in at_once.data.experiments]
        self.seen = _seen(_as_given(at_once), at_once)
        self.report()

    @property
    def fitted(self) -> BaseFit:
        """The model as it stands now."""
        return self._whole

    def report(self, **found: Any) -> None:
        """With what is new."""
        self.seen = replace(self.seen, **found)
        self._add_laws()
        self._progress.partial(LOOKED, self.seen)

    def check(self) -> None:
        """Errors of the same fit on validation recordings; as slow as the first ranking."""
        from flexgui.core.diagnose.stated_results import compare_with_recordings

        if self._checked or self._progress.stopped():
            return
        self._checked = True
        self.report(step=_as_given(self._whole))
        if not self._progress.stopped():
            self._shown = compare_with_recordings(self._whole)
            self._progress.partial(COMPARED, self._shown)

    def settled(self, last: BaseFit) -> None:
        """The final fit of the diagnosis; from now on all figures are of it."""
        self._checked = self._checked and last.data.floors == self._whole.data.floors
        self._whole = last
        self.report(step=_as_given(last), residual=_seen(self.seen.step, last).residual)
        self.check()

    def _add_laws(self) -> None:
        """Of the first of the list, again where that or its sizes have changed."""

        first = next(iter(self.seen.ranking), None)
        if first is None or not self._shown:
            return
        best = (first.effect, tuple(e.value for e in first.parameters))
        if best != self._best:
            self._best = best
            laws = laws_of(self._whole.base.problem.model, self._shown, first)
            self.seen = replace(self.seen, laws=laws, laws_of=first.effect)


def _as_given(begun: BaseFit) -> LadderStep:
    from flexgui.core.diagnose.stated_results import ladder_step

    return ladder_step(begun.data, begun.validation_fit, begun.base, None, "As given", ())


def _seen(step: LadderStep, begun: BaseFit) -> ModelFindings:
    blocks = begun.base.errors
    experiments = begun.data.experiments
    strides = [_stride(block) for block in blocks]
    dt = [_spacing(e.time) * s for e, s in zip(experiments, strides, strict=True)]
    return ModelFindings(
        step=step,
        recordings=tuple(e.recording.name for e in experiments),
        channels=tuple(tuple(name for name, _ in e.channels) for e in experiments),
        dt=tuple(dt),
        residual=tuple(_thin(b, e.counted) for b, e in zip(blocks, experiments, strict=True)),
    )


def refined(scenario: Scenario, where: ConfinedFolder, progress: PartialProgress) -> Outcome:
    """The identification without its search: a refinement from where the parameters start."""
    from flexgui.core.workbench import run_scenario

    spec = scenario.identify.model_copy(update={"generations": 0, "refine": True})
    plain = without_diagnosis(scenario).model_copy(update={"identify": spec, "compare": ()})
    progress.stage("Preparing the figures of this model")
    return run_scenario(plain, folder=where, progress=Unseen(progress))


def thinned(
    ranking: tuple[RankedEffect, ...], counted: Sequence[np.ndarray], named: str | None = None
) -> tuple[RankedEffect, ...]:
    """In the order of the list, with predictions only for the effects that are pictured, at the
    samples (rows, channels) of each recording that are `counted`."""
    return tuple(
        replace(
            r,
            predicted=tuple(
                _thin(p, c) for p, c in zip(r.predicted, counted, strict=False) if k < PICTURED
            ),
        )
        for k, r in enumerate(in_order(ranking, named))
    )


def _stride(block: np.ndarray) -> int:
    return max(-(-len(block) // MOST_ROWS), 1)


def _thin(block: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """The first sample of each stretch that counts; NaN where none does."""
    stride = _stride(block)
    shown = np.where(counted, block, np.nan)
    padded = np.pad(shown, ((0, -len(shown) % stride), (0, 0)), constant_values=np.nan)
    stretches = padded.reshape(-1, stride, shown.shape[1])
    first = np.argmax(np.isfinite(stretches), axis=1)[:, None]
    return np.take_along_axis(stretches, first, axis=1)[:, 0].astype(np.float32)


def _spacing(time: np.ndarray) -> float:
    return float(time[1] - time[0]) if len(time) > 1 else 1.0


ROWS = 600
"""Samples drawn of a law that depends on more than the speed."""


def laws_of(
    model: Model, shown: Sequence[RecordingComparison], ranked: RankedEffect
) -> tuple[tuple[OverSpeed, ...], ...]:
    """For each recording, with the sizes that a refit has found; empty where the effect is no force
    law at the joints, is unknown to the catalogue, or was not refitted yet."""
    effect = catalogue().get(ranked.effect)
    if effect is None or not ranked.parameters or effect.acts_at not in ("joints", "drive"):
        return ()
    sizes = {e.name: e.value for e in ranked.parameters}
    grown = model.with_effects([*model.effects, effect], {**model.effect_values, **sizes})
    have = {e.kind for e in model.effects}
    added = [e for e in grown.effects if e.kind not in have]
    laws = []
    for each in shown:
        if each.motion is None:
            return ()
        rows = slice(None, None, max(1, -(-len(each.motion.velocity) // ROWS)))
        place, speed = each.motion.position[rows], each.motion.velocity[rows]
        p = grown.numbers(grown.effect_values).p
        laws.append(over_speed(added, grown.arm, p, grown.effect_values, place, speed))
    return tuple(laws) if all(laws) else ()
