"""Recordings of random rigs for the data check: what a newcomer has whose numbers are off.

Arms, drives, sensors and stated stiffness are those of the plain matrix; in half of the rigs the
joints rub, which no scenario says.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexgui.core.check.case import Case
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import sizes_of
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from tests.check.rigs import Rig
from tests.programs.studies.plain_matrix_rigs import Rig as Bench
from tests.programs.studies.plain_matrix_rigs import drawn

RECORDINGS = 4
"""Of each rig: enough that others say what is usual; the last is for validation."""

FRICTION = 0.1, 0.5
"""Of a joint's rms torque that is dry friction: from a good bearing to a stiff harmonic drive."""


def checked_rig(seed: int) -> Rig:
    """The recordings of a random rig, with the model that its scenario states."""
    bench = drawn(seed)
    bench = replace(bench, postures=bench.postures[-RECORDINGS:])
    machine = _rubbing(bench, seed) if seed % 2 else bench.healthy
    motions = [bench.roughly(machine, i) for i in range(len(bench.postures))]
    clean = [bench.recording(machine, i, m) for i, m in enumerate(motions)]
    scenario = Scenario.model_validate(bench.document())
    recordings = bench.measured(clean, seed)
    return Rig(f"rig {seed}", [Case(_as_measured(r, scenario)) for r in recordings])


def _rubbing(bench: Bench, seed: int) -> Model:
    """The bench's machine with dry friction in its joints."""
    rng = np.random.default_rng([seed, 17])
    rows = range(len(bench.postures))
    sizes = sizes_of([bench.roughly(bench.healthy, i) for i in rows])
    shares = rng.uniform(*FRICTION, bench.joints)
    values = {f"fc{k + 1}": float(s * sizes.torque[k]) for k, s in enumerate(shares)}
    return bench.healthy.with_effects([effect("coulomb_friction")], values, sizes)


def _as_measured(r: Recording, scenario: Scenario) -> MeasuredRecording:
    model, spec = base_model(scenario), scenario.identify
    return MeasuredRecording(r.name, r.role, r.time, r.channels, model=model, identify=spec)


def coarse(found: MeasuredRecording, channel: str, seed: int) -> bool:
    """Whether the rig's encoder has steps above a twentieth of the motion."""
    return bool(drawn(seed).encoder_step > 0.05 * np.std(found.channels[channel]))
