"""From a scenario to its outcome: load, fit, compare."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from .check.run_checks import check_scenario
from .diagnose.diagnose import diagnose, fit_base_to_recordings
from .diagnose.search_options import DEFAULT_EFFECTS, Options
from .diagnosed_scenario import diagnosed_scenario
from .errors import InputError
from .identify.compare import compare_many
from .identify.fit import Fitted
from .identify.setup import Setup, make_setup
from .identify.unknown_gains import gain_starts
from .information_criteria import added_up
from .linear_or_nonlinear import AUTO, choose_level
from .loading import load_recordings
from .model import Model
from .noise.output_noise import stated_noise
from .noise.repeated_motions import compare_repeated_runs
from .noise.whitening import error_products
from .processors import fast_thread_switching, is_limited
from .profile_likelihood import profile_likelihood
from .progress import Progress, Silent, beside
from .propose.competition import LAWS
from .propose.propose import propose
from .recording.recording import Recording
from .results import (
    Diagnosis,
    ErrorProducts,
    Estimate,
    Fit,
    LevelChoice,
    LinearModel,
    Outcome,
    Profile,
    Proposal,
    RecordingComparison,
)
from .results.identification import final_values, labelled, values_in
from .scenario.data_folder import Folder
from .scenario.schema import IdentifySpec, Scenario
from .scenario.stated_effects import base_model, candidate_effects, with_effect_parameters
from .scenario.stated_effects import diagnosis_wanted as diagnosis_wanted
from .scenario_fits import compare_all, compared_variant, fit_all, setup_of_fits, shared_by_fits
from .sentences import listed
from .simulate.descriptor import descriptor, prepare_descriptor
from .simulate.equations import equations, prepare_equations
from .simulate.mechanism import mechanism
from .simulate.state_equations import state_equations
from .validation import naming_scenario

AS_STATED = "the stated values"
NOT_CHECKED = "The recordings were not checked for faults."


@dataclass
class Clock:
    """Seconds per kind of work."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def timed(self, what: str):  # type: ignore[no-untyped-def]
        """Add what the block takes, in s, to the time of `what`."""
        start = time.perf_counter()
        yield
        self.seconds[what] = self.seconds.get(what, 0.0) + time.perf_counter() - start


@fast_thread_switching()
@naming_scenario
def run_scenario(
    scenario: Scenario, *, folder: Folder | None = None, data_folder: Path | None = None,
    progress: Progress | None = None, check: bool = True,
) -> Outcome:  # fmt: skip
    """The outcome of a scenario; `folder`: where its relative files are; `check`: whether its
    recordings are checked for faults."""
    progress, clock = progress or Silent(), Clock()
    with clock.timed("load"):
        progress.stage("Reading the recordings", len(scenario.recordings))
        model = base_model(scenario)
        candidate_effects(scenario.diagnose)  # a slip there is reported before the long work
        spec = with_effect_parameters(scenario.identify, model, scenario.model)
        recordings = load_recordings(scenario, model, folder or Path(), data_folder, progress)
        if scenario.model.level == AUTO:
            progress.stage("Choosing the level of the model")
        model, chosen = model_at_level(scenario, model, spec, recordings)
        setup = make_setup(model, spec, recordings)
    if not is_limited():
        threading.Thread(target=_prepare_forms, args=(setup.model,), daemon=True).start()
    with clock.timed("identify"):
        fits = fit_all(setup, recordings, spec, progress)
        setup = setup_of_fits(setup, fits)
    with clock.timed("compare"):
        progress.stage("Comparing the model with the measurements", len(recordings))
        comparisons = compare_all(setup, recordings, fits, spec, progress)
        variants = tuple(
            compared_variant(scenario, i, variant, recordings, progress)
            for i, variant in enumerate(scenario.compare)
        )
    checked = partial(_findings, scenario, folder, data_folder, fits)
    with beside(checked, progress) if check else nullcontext(tuple) as findings:
        diagnosis = None
        if diagnosis_wanted(scenario) and not progress.stopped():
            with clock.timed("diagnose"):
                diagnosis = _diagnosis(scenario, setup, recordings, spec, fits, progress)
                if setup.model.level == "lpv":
                    linear = linear_model([f.fit for f in fits], comparisons, diagnosis)
                    diagnosis = replace(diagnosis, linear_model=linear)
        with clock.timed("load"):
            found = findings()
    left = added_up([_left(f) for f in fits])
    standing, values, shown = _final_model(scenario, setup, fits, diagnosis)
    unchecked = () if check else (NOT_CHECKED,)
    return Outcome(
        title=scenario.title, method=scenario.identify.method, level=setup.model.level,
        fits=tuple(f.fit for f in fits), comparisons=comparisons,
        model=descriptor(standing, standing.numbers(values)), equations=equations(standing),
        variants=variants, seconds=clock.seconds, chosen_level=chosen,
        notes=(*setup.notes, *shown, *_warnings(recordings), *unchecked), findings=found,
        arm_table=_arm_table(model), diagnosis=diagnosis,
        repeated=compare_repeated_runs(fits),
        origins=_origins(setup.model, fits), mechanism=mechanism(standing, values),
        state_equations=state_equations(standing, values), left=left,
    )  # fmt: skip


def _left(fitted: Fitted) -> ErrorProducts:
    """The errors of a fit, for BIC."""
    r = fitted.residuals
    count = len(fitted.vector)
    return error_products(r.experiments, r.blocks(fitted.vector), r.weights, count)


def _findings(
    scenario: Scenario, folder: Folder | None, data_folder: Path | None,
    fits: Sequence[Fitted], progress: Progress,
) -> tuple[str, ...]:  # fmt: skip
    """Faults of the recordings from files; simulated ones are not checked."""
    files = tuple(spec for spec in scenario.recordings if spec.file is not None)
    if not files:
        return ()
    from_files = scenario.model_copy(update={"recordings": files})
    values = {**final_values([f.fit for f in fits]), **shared_by_fits(fits)}
    try:
        sized = not diagnosis_wanted(scenario)
        findings = check_scenario(
            from_files, folder or Path(), data_folder, progress, values, sized
        )
    except InputError:
        if progress.stopped():  # while a file was read
            return ()
        raise
    return tuple(finding.sentence for finding in findings if finding.is_fault)


def _prepare_forms(model: Model) -> None:
    """Prepares symbolic forms for the end in the background, which takes a second."""
    with suppress(Exception):  # whoever needs them says what is wrong
        prepare_equations(model)
        prepare_descriptor(model)


@naming_scenario
def compare_at(
    scenario: Scenario, values: Mapping[str, float], *, folder: Folder | None = None,
    data_folder: Path | None = None, progress: Progress | None = None,
) -> tuple[RecordingComparison, ...]:  # fmt: skip
    """Measured and modelled signals at given parameter values (SI); nothing is estimated. Other
    parameters are as stated."""
    progress = progress or Silent()
    progress.stage("Reading the recordings", len(scenario.recordings))
    model = base_model(scenario)
    model.check_values(values)
    recordings = load_recordings(scenario, model, folder or Path(), data_folder, progress)
    model, _ = model_at_level(scenario, model, scenario.identify, recordings)
    setup = make_setup(model, scenario.identify, recordings)
    gains = gain_starts(setup.model, setup.outputs, recordings, values)
    all_values = {**gains, **scenario.identify.start, **values}
    progress.stage("Comparing the model with the measurements", len(recordings))
    chosen = [(r, all_values, AS_STATED) for r in recordings]
    comparisons = compare_many(setup.model, chosen, setup.outputs, setup.processing)
    progress.advance(len(recordings))
    return tuple(comparisons)


def _final_model(
    scenario: Scenario, setup: Setup, fits: Sequence[Fitted], diagnosis: Diagnosis | None
) -> tuple[Model, Mapping[str, float], tuple[str, ...]]:
    """The model with the added effects, its values at the end of the last fit, and a sentence on
    those that it has of one recording only."""
    first = fits[0].fit.recordings[0]
    if diagnosis is None or not diagnosis.effects:
        model = setup.model.steered_by(None)
        known = {**final_values([f.fit for f in fits]), **shared_by_fits(fits)}
    else:
        model = base_model(diagnosed_scenario(scenario, diagnosis))
        known = dict(diagnosis.values)
    own = [name for name in model.parameters if labelled(name, first) in known]
    text = f"Matrices and exported models have {listed(own)} of {first}: it differs by recording."
    return model, values_in(first, known), (text,) if own else ()


def _origins(model: Model, fits: Sequence[Fitted]) -> dict[str, str]:
    names = {e.name for f in fits for e in (*f.fit.estimates, *f.fit.derived)}
    return {name: model.origin(name) for name in sorted(names)}


def _diagnosis(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording], spec: IdentifySpec,
    fits: Sequence[Fitted], progress: Progress,
) -> Diagnosis:  # fmt: skip
    """The diagnosis; what it finds is only proposed if no effect may be added."""
    setup, spec, options = _options(scenario, setup, recordings, spec)
    options = replace(options, identified=final_values([f.fit for f in fits]))
    laws = LAWS if scenario.diagnose.propose else None
    return diagnose(setup, spec, recordings, options, progress, laws=laws)


def _options(
    scenario: Scenario, setup: Setup, recordings: Sequence[Recording], spec: IdentifySpec
) -> tuple[Setup, IdentifySpec, Options]:
    """What a diagnosis compares, and its options."""
    settings = scenario.diagnose
    options = Options(
        max_effects=settings.max_effects or DEFAULT_EFFECTS, adds=settings.max_effects > 0,
        candidates=settings.candidates or (),
        fidelity=settings.fidelity, per_recording=settings.per_recording,
        stated_rig=scenario.rig.statements,
    )  # fmt: skip
    if settings.output is not None:
        spec = spec.model_copy(update={"output": settings.output})
        setup = make_setup(base_model(scenario), spec, recordings)
    noise = stated_noise(scenario, setup, recordings)
    return setup, spec, replace(options, stated_noise=noise)


def _read(
    scenario: Scenario, folder: Folder | None, data_folder: Path | None, progress: Progress
) -> tuple[Model, IdentifySpec, list[Recording]]:
    """The model as stated, what is estimated in it, and the recordings."""
    progress.stage("Reading the recordings", len(scenario.recordings))
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    where = folder or Path()
    return model, spec, list(load_recordings(scenario, model, where, data_folder, progress))


@naming_scenario
def propose_for(
    scenario: Scenario, *, folder: Folder | None = None, data_folder: Path | None = None,
    progress: Progress | None = None,
) -> Proposal:  # fmt: skip
    """Laws for what the scenario's model, fitted as it is, leaves of the recordings."""
    progress = progress or Silent()
    model, spec, recordings = _read(scenario, folder, data_folder, progress)
    setup, spec, options = _options(scenario, make_setup(model, spec, recordings), recordings, spec)
    fitted = fit_base_to_recordings(setup, spec, recordings, options, progress)
    return propose(fitted, options, progress)


@naming_scenario
def profile_for(
    scenario: Scenario, name: str, recording: str | None = None, *, level: float = 0.95,
    folder: Folder | None = None, data_folder: Path | None = None,
    progress: Progress | None = None,
) -> Profile:  # fmt: skip
    """Profile likelihood of a parameter over the estimation recordings, or of one of them, which a
    local method needs (else InputError), with the interval of that `level` of probability."""
    progress = progress or Silent()
    model, spec, recordings = _read(scenario, folder, data_folder, progress)
    model, _ = model_at_level(scenario, model, spec, recordings)
    group = [r for r in recordings if r.role == "estimate" and recording in (None, r.name)]
    if not group or (recording is None and spec.method == "local" and len(group) > 1):
        names = [r.name for r in recordings if r.role == "estimate"]
        raise InputError(f"A profile is of one fit; choose a recording of {listed(names)}.")
    progress.stage(f"Holding {name} beside its estimate")
    setup = make_setup(model, spec, recordings)
    return profile_likelihood(setup, group, spec, name, progress, level)


def linear_model(
    fits: Sequence[Fit], comparisons: Sequence[RecordingComparison], diagnosis: Diagnosis
) -> LinearModel:
    """Error of the linear model relative to the full equations on the estimation recordings.

    `fits` and `comparisons` are of the linear model, `diagnosis` is on the same recordings.
    """
    tips = [c.tip_rms for c in comparisons if c.role == "estimate" and c.tip_rms is not None]
    linear = float(np.sqrt(np.mean(np.square(tips)))) if tips else None
    first = diagnosis.steps[0]
    floors = [e.floor for e in first.errors if e.channel in ("z1", "z2")]
    floor = float(np.sqrt(np.sum(np.square(floors)))) if floors else float("nan")
    estimates = [e for f in fits if len(fits) == 1 for e in (*f.estimates, *f.derived)]
    return LinearModel(
        linear, first.tip_rms, floor, largest_difference(estimates, first.parameters)
    )


LEAST_DIFFERENCE = 0.1
"""Relative difference above which two fits disagree. What a useful linear model leaves out moves a
stiffness by a few per cent."""


def largest_difference(
    linear: Sequence[Estimate], full: Sequence[Estimate]
) -> tuple[Estimate, Estimate] | None:
    """The estimate that both fits determine with the largest difference; None if they agree."""
    full_values = {e.name: e for e in full if e.identifiable and e.recording is None and e.value}
    pairs = [(e, full_values[e.name]) for e in linear if e.identifiable and e.name in full_values]
    far = [p for p in pairs if abs(p[0].value - p[1].value) > LEAST_DIFFERENCE * abs(p[1].value)]
    return max(far, key=lambda p: abs(p[0].value / p[1].value - 1.0), default=None)


def model_at_level(
    scenario: Scenario, model: Model, spec: IdentifySpec, recordings: Sequence[Recording]
) -> tuple[Model, LevelChoice | None]:
    """The model at the stated level or, for auto, at the level that the recordings need, with the
    reason."""
    if scenario.model.level != AUTO:
        return model, None
    setup = make_setup(model, spec, recordings)
    noise = stated_noise(scenario, setup, recordings)
    fidelity = scenario.diagnose.fidelity
    choice = choose_level(setup.model, setup.outputs, setup.processing, recordings, noise, fidelity)
    if choice.level == model.level:
        return model, choice
    bare = None if model.bare is None else model.bare.at_level(choice.level)
    return replace(model.at_level(choice.level), bare=bare), choice


def _warnings(recordings: Sequence[Recording]) -> list[str]:
    return list(dict.fromkeys(f"{r.name}: {text}" for r in recordings for text in r.warnings))


def _arm_table(model: Model) -> tuple[tuple[str, str, float, str], ...]:
    items = model.parameters.values()
    return tuple((p.name, p.title, p.value, p.unit) for p in items if p.value != 0.0)
