"""Look at a model: how well it fits, and what could be missing in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from core.diagnose.diagnose import Options
    from core.diagnose.start import Begun
    from core.identify.setup import Setup
    from core.recording.recording import Recording
    from core.results import LadderStep, Outcome, RankedEffect
    from core.scenario.schema import IdentifySpec
    from flexgui.jobs.looked import Looked, Teller

LOOKED, COMPARED = "looked", "compared"
"""The names of what is streamed: the look, growing, and once measured against modelled."""

BEFORE, AFTER = "before", "after"
"""When the identification is done: after an effect was added, its fit is what is waited for."""

MOST_ROWS = 1000
"""Of a recording's residual that a picture is drawn of."""

PICTURED = 10
"""Effects whose predictions are kept, the best."""


class Asked(NamedTuple):
    """What is looked at, and how far."""

    recordings: list[Recording]
    setup: Setup
    spec: IdentifySpec
    options: Options


def diagnose(
    scenario_toml: str,
    folder: str | None = None,
    data_folder: str | None = None,
    fit: str = "",
    *,
    progress: Teller,
) -> Looked:
    """The ranking on the scenario's model, with nothing added to it.

    `fit`: also identify, from where the parameters start, "before" or "after" the ranking. The step
    of the error ladder is told first; the ranking after the screen and after each refit.
    """
    from core.diagnose.diagnose import diagnose as look_for
    from core.scenario.read import parse_scenario
    from core.scenario.stated_effects import with_effect_parameters
    from core.workbench import base_model

    scenario = parse_scenario(scenario_toml, "The scenario")
    where = (Path(folder or "."), Path(data_folder) if data_folder else None)
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    asked = _asked(scenario, model, spec, where, progress)
    state, begun = first_look(asked, progress)
    if fit == BEFORE and not progress.stopped():
        state = replace(state, outcome=refined(scenario_toml, where, progress))
        progress.partial(LOOKED, state)

    def listen(ranking: tuple[RankedEffect, ...]) -> None:
        nonlocal state
        state = replace(state, ranking=thinned(ranking))
        progress.partial(LOOKED, state)

    found = look_for(
        asked.setup, asked.spec, asked.recordings, asked.options, progress, listen, begun
    )
    light = tuple(replace(r, ranking=thinned(r.ranking)) for r in found.rounds)
    state = replace(state, ranking=thinned(found.ranking), diagnosis=replace(found, rounds=light))
    if fit == AFTER and not progress.stopped():
        progress.partial(LOOKED, state)
        state = replace(state, outcome=refined(scenario_toml, where, progress))
    return state


def _asked(
    scenario: Any, model: Any, spec: IdentifySpec, where: tuple[Path, Path | None], progress: Teller
) -> Asked:
    from core.diagnose.diagnose import Options
    from core.diagnose.stated_noise import stated_noise
    from core.errors import InputError
    from core.identify.setup import make_setup
    from core.loading import load_recordings
    from core.scenario.stated_effects import candidate_effects

    asked = scenario.diagnose
    candidate_effects(asked)  # a slip there is told before the long work
    if asked.output is not None:
        spec = spec.model_copy(update={"output": asked.output})
    progress.stage("Reading the recordings", len(scenario.recordings))
    recordings = list(load_recordings(scenario, model, *where, progress))
    if not any(r.role == "estimate" for r in recordings):
        raise InputError('No recording has role = "estimate"; give at least one to diagnose.')
    setup = make_setup(model, spec, recordings)
    options = Options(
        max_effects=0,
        compare=False,  # the first look tells it sooner
        candidates=asked.candidates or (),
        fidelity=asked.fidelity,
        stated_noise=stated_noise(scenario, setup, recordings),
        per_recording=asked.per_recording,
    )
    return Asked(recordings, setup, spec, options)


def first_look(asked: Asked, progress: Teller) -> tuple[Looked, Begun]:
    """The model fitted as it is: its step of the ladder and what it leaves of the recordings; told
    at once, and after it measured against modelled by the same fit."""
    from core.diagnose.compared import compared
    from core.diagnose.diagnose import begin_on
    from core.diagnose.steps import ladder_step

    begun = begin_on(asked.setup, asked.spec, asked.recordings, asked.options, progress)
    step: LadderStep = ladder_step(begun.data, begun.validation, begun.base, None, "As given", ())
    looked = _seen(step, begun)
    progress.partial(LOOKED, looked)
    if not progress.stopped():
        progress.partial(COMPARED, compared(begun))
    return looked, replace(begun, validation=None)  # the others have had their look


def _seen(step: LadderStep, begun: Begun) -> Looked:
    from flexgui.jobs.looked import Looked

    blocks = begun.base.errors
    experiments = begun.data.experiments
    strides = [_stride(block) for block in blocks]
    dt = [_spacing(e.time) * s for e, s in zip(experiments, strides, strict=True)]
    return Looked(
        step=step,
        recordings=tuple(e.recording.name for e in experiments),
        channels=tuple(tuple(name for name, _ in e.channels) for e in experiments),
        dt=tuple(dt),
        residual=tuple(_thin(block) for block in blocks),
    )


def refined(scenario_toml: str, where: tuple[Path, Path | None], progress: Teller) -> Outcome:
    """The identification without its search: a refinement from where the parameters start."""
    import tomllib

    from core.scenario.read import check_scenario
    from core.workbench import run_scenario

    document = tomllib.loads(scenario_toml)
    for table in ("diagnose", "compare"):
        document.pop(table, None)
    document.setdefault("identify", {}).update(generations=0, refine=True)
    scenario = check_scenario(document, "The scenario")
    return run_scenario(scenario, folder=where[0], data_folder=where[1], progress=progress)


def thinned(ranking: tuple[RankedEffect, ...]) -> tuple[RankedEffect, ...]:
    """With as many rows of predictions as pictures show, and none of those far down."""
    return tuple(
        replace(r, predicted=tuple(_thin(p) for p in r.predicted) if k < PICTURED else ())
        for k, r in enumerate(ranking)
    )


def _stride(block: np.ndarray) -> int:
    return max(-(-len(block) // MOST_ROWS), 1)


def _thin(block: np.ndarray) -> np.ndarray:
    return np.asarray(block[:: _stride(block)], dtype=np.float32)


def _spacing(time: np.ndarray) -> float:
    return float(time[1] - time[0]) if len(time) > 1 else 1.0
