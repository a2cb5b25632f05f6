"""Simulates what one effect does to the arm, in a worker, beside a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.effects import effect
from flexgui.core.effects.effect import Effect, Rig
from flexgui.core.effects.sizes import sizes_of, typical
from flexgui.core.errors import InputError
from flexgui.core.results import MissingTorque, RecordingComparison
from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.stated_effects import base_model, with_effect_parameters
from flexgui.jobs import Event, Failed, Finished, Job, WorkerLost
from flexgui.jobs.messages import Task
from flexgui.scene.recorded_motion import read_recording
from flexgui.session.state import Topic
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import Demonstration
from flexgui.views.headline import fitted_values
from flexgui.views.over_speed import OverSpeed, over_speed

if TYPE_CHECKING:
    from flexgui.core.identify.setup import Setup
    from flexgui.core.model import Model
    from flexgui.core.parameters import Parameter
    from flexgui.core.progress import Progress
    from flexgui.core.recording.recording import Recording
    from flexgui.core.scenario.schema import Scenario
    from flexgui.session.session import Session

LEAST = 1e-9


class Demonstrations:
    """One demonstration at a time; a new request replaces the last one."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.shown: Demonstration | None = None
        self.kind = ""
        """Id of the effect that is shown or will be; empty: none."""
        self.not_shown = ""
        """Why there is nothing to show, a sentence."""
        self._shower: Job | None = None

    def start(self, kind: str, sizes: Mapping[str, float] | None = None) -> bool:
        """Simulates the recording under the cursor with and without the effect, of these `sizes`;
        None: as they were refitted."""
        self.end()
        scenario = self._session.document.scenario
        names = [spec.name for spec in scenario.recordings]
        if not names:
            return self._cannot(kind, "There is no recording to show the effect on.")
        cursor = self._session.playback.cursor
        name = cursor.recording if cursor.recording in names else names[0]
        fitted = self._session.identification.current
        task = Task.of(
            demonstrate, "The demonstration", scenario=scenario, kind=kind,
            recording=name, values=fitted_values(fitted, name),
            sizes=self._sizes(kind) if sizes is None else dict(sizes),
            floors=self._session.comparison.floors or {}, folder=str(self._session.folder),
        )  # fmt: skip
        with self._session.lock:
            self.kind = kind
        try:
            pool = self._session.services.pool
            job = pool.submit(self._session.key, task, lambda event: self._hear(kind, event))
        except InputError as error:
            return self._cannot(kind, str(error))
        with self._session.changing(Topic.DEMONSTRATION):
            self._shower = job
        return True

    @property
    def torques(self) -> tuple[MissingTorque, ...]:
        """Missing torque in the demonstrated recording; empty before a diagnosis."""
        shown, version = self.shown, self._session.diagnosis.newest
        if shown is None or version is None or not shown.torques:
            return ()
        scenario = self._session.document.scenario
        if version.scenario != scenario or shown.kind in dict(present(scenario)):
            return ()
        matches = [c for c in version.comparisons if c.recording == shown.recording]
        return matches[0].missing_torque if matches else ()

    def end(self) -> None:
        """Hides the demonstration."""
        with self._session.lock:
            job, self._shower = self._shower, None
            self.shown, self.kind, self.not_shown = None, "", ""
        if job is not None and not job.over:
            job.stop()
        self._session.notify(Topic.DEMONSTRATION)

    def scenario_changed(self) -> None:
        """Ends a demonstration of another arm."""
        if self.kind:
            self.end()

    def _cannot(self, kind: str, sentence: str) -> bool:
        with self._session.changing(Topic.DEMONSTRATION):
            self.kind, self.not_shown = kind, sentence
        return False

    def _sizes(self, kind: str) -> dict[str, float]:
        """Refitted sizes of the effect from the ranking; empty without a refit."""
        version = self._session.diagnosis.newest
        ranked = () if version is None else version.ranking
        match = next((r for r in ranked if r.effect == kind), None)
        sizes = {e.name: e.value for e in match.parameters} if match is not None else {}
        return sizes if any(abs(value) > LEAST for value in sizes.values()) else {}

    def _hear(self, kind: str, event: Event) -> None:
        if kind != self.kind:
            return
        if isinstance(event, Finished):
            with self._session.changing(Topic.DEMONSTRATION):
                self.shown = event.result
        elif isinstance(event, Failed | WorkerLost):
            self._cannot(kind, event.sentence)


SHOWN_SECONDS = 0.6
"""Of the stretch that is shown: some periods of the first bending mode of a usual arm."""

SEEN = 1e-9
"""Share of an output's spread; what moves all outputs by less does nothing here."""


def demonstrate(
    scenario: Scenario,
    kind: str,
    recording: str,
    values: Mapping[str, float],
    sizes: Mapping[str, float],
    floors: Mapping[str, float],
    folder: str | None = None,
    *,
    progress: Progress,
) -> Demonstration:
    """Simulates with and without the effect; without `sizes` it takes plausible ones.

    InputError where the arm cannot have the effect, or where it shows in no output.
    """
    progress.stage("Simulating the arm with and without the effect")
    setup, data = _compared_in_outputs(scenario, recording, ConfinedFolder(Path(folder or ".")))
    shown = _effect(setup, kind)
    bare, grown = _models(setup, data, shown, values, sizes)
    plain, more = (_compared(model, data, setup, values) for model in (bare, grown))
    place = _place(plain, more, data, floors)
    if place is None:
        raise InputError(f"{shown.title} of this size changes no output of {recording}.")
    k, rows = place
    without, with_it = plain.channels[k], more.channels[k]
    return Demonstration(
        kind=kind,
        title=shown.title,
        recording=recording,
        channel=without.channel,
        unit=without.unit,
        time=without.time[rows],
        measured=np.where(without.counted, without.measured, np.nan)[rows],
        without=without.model[rows],
        with_it=with_it.model[rows],
        sizes=_sizes(shown, grown),
        torques=_torques(bare, grown, plain, values),
    )


def _compared_in_outputs(
    scenario: Scenario, name: str, folder: ConfinedFolder
) -> tuple[Setup, Recording]:
    """The setup with the outputs in which a diagnosis ranks effects."""
    from flexgui.core.diagnose.base_fit import compared_outputs
    from flexgui.core.identify.setup import make_setup

    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    if scenario.diagnose.output is not None:
        spec = spec.model_copy(update={"output": scenario.diagnose.output})
    # Only recordings to estimate from decide which outputs there are.
    data = replace(read_recording(scenario, name, folder), role="estimate")
    setup = make_setup(model, spec, [data])
    return replace(setup, outputs=compared_outputs(setup.model, setup.outputs, [data])), data


def _effect(setup: Setup, kind: str) -> Effect:
    model = setup.model
    present = next((e for e in model.effects if e.kind == kind), None)
    if present is not None:
        return present
    listed = effect(kind)
    kinds = tuple(s.kind for s in setup.outputs)
    rig = Rig(model.arm, model.drive, model.level, kinds, model.steering is not None)
    if reason := listed.not_applicable(rig):
        raise InputError(f"{listed.title} cannot be shown here: {reason}")
    return listed


def _models(
    setup: Setup, data: Recording, shown: Effect, values: Mapping[str, float],
    sizes: Mapping[str, float],
) -> tuple[Model, Model]:  # fmt: skip
    """The models without and with the effect, at the same level."""
    from flexgui.core.identify.prepared_recording import make_task
    from flexgui.core.simulate.linear import respond

    model = setup.model
    others = [e for e in model.effects if e.kind != shown.kind]
    plain = {**model.effect_values, **{k: v for k, v in values.items() if "@" not in k}}
    bare = model.with_effects(others, plain)
    lpv = bare.at_level("lpv")
    motion = respond(lpv, [lpv.numbers(values)], [make_task(lpv, data)])[0]
    grown = model.with_effects([*others, shown], {**plain, **sizes}, sizes_of([motion]))
    if shown.kind not in {e.kind for e in grown.effects}:
        grown = model.with_effects([*others, shown], plain, sizes_of([motion]))
    same = bare if shown.kind == "large_motion" else bare.at_level(grown.level)
    return same, grown


def _sizes(one: Effect, grown: Model) -> tuple[Parameter, ...]:
    """The effect's parameters at the simulated values."""
    quantities = one.parameters(grown.arm, grown.drive, typical(grown.arm))
    known = grown.effect_values
    return tuple(
        replace(k.parameter, value=value, lower=min(k.parameter.lower, value), upper=np.inf)
        for k in quantities
        if (value := float(known.get(k.parameter.name, np.nan))) == value
    )


def _torques(
    bare: Model, grown: Model, plain: RecordingComparison, values: Mapping[str, float]
) -> tuple[OverSpeed, ...]:
    """Torque over speed of the effect and of those it includes."""
    have, motion = {e.kind for e in bare.effects}, plain.motion
    added = [e for e in grown.effects if e.kind not in have]
    if motion is None or not any(e.acts_at in ("joints", "drive") for e in added):
        return ()
    p = grown.numbers({**values, **grown.effect_values}).p
    return over_speed(added, grown.arm, p, grown.effect_values, motion.position, motion.velocity)


def _compared(
    model: Model, data: Recording, setup: Setup, values: Mapping[str, float]
) -> RecordingComparison:
    from flexgui.core.identify.compare import compare

    all_values = {**values, **model.effect_values}
    return compare(model, data, setup.outputs, setup.processing, all_values, "")


def _place(
    without: RecordingComparison,
    with_it: RecordingComparison,
    data: Recording,
    floors: Mapping[str, float],
) -> tuple[int, slice] | None:
    """The measured output that changes most, in noise floors or its own spread, and where."""
    best, place = SEEN, None
    for k, (a, b) in enumerate(zip(without.channels, with_it.channels, strict=True)):
        if not (data.has(a.channel) or a.fitted):
            continue
        change = np.nan_to_num(b.model - a.model)
        unit = floors.get(a.channel) or float(np.nanstd(a.measured)) or 1.0
        size = float(np.sqrt(np.mean(change**2))) / unit
        if size > best:
            best, place = size, (k, _stretch(a.time, change))
    return place


def _stretch(time: np.ndarray, change: np.ndarray) -> slice:
    """The rows of SHOWN_SECONDS s with the largest change."""
    dt = float(time[1] - time[0]) if len(time) > 1 else 1.0
    rows = min(max(int(SHOWN_SECONDS / dt), 2), len(change))
    energy = np.concatenate([[0.0], np.cumsum(change**2)])
    at = int(np.argmax(energy[rows:] - energy[:-rows]))
    return slice(at, at + rows)
