"""EMPS by the rules of its benchmark: Janot, Gautier and Brunot, "Data set and reference models of
EMPS", Workshop on Nonlinear System Identification Benchmarks, 2019.

Everything is estimated on the first recording; the second one, with pulses, only judges.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import butter, sosfiltfilt

from flexgui.core.arm.arm import Arm
from flexgui.core.drives.drive import Drive
from flexgui.core.drives.law import DriveLaw
from flexgui.core.parameters import Parameter
from flexgui.core.results import Outcome
from flexgui.core.scenario.read import check_scenario, read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.motion import Task, at_rest
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.workbench import run_scenario

ESTIMATED, JUDGED = "emps.csv", "emps_pulses.csv"
SCENARIO = Path(__file__).resolve().parents[3] / "scenarios" / "emps.toml"

MOTION_HZ, FORCE_HZ = 100.0, 30.0
"""Cut-offs of the scenario's filters, on measurement and model alike."""
DECIMATED = 10
FIRST = 20
"""Samples of the judged recording that a free run may see: the benchmark's rule for the start."""
COLUMNS = {"theta1": "q", "theta1_ref": "q_ref", "u1": "force"}


@dataclass(frozen=True)
class Loop:
    """force = gain (kp (q_ref - q) - q') + volt pulse."""

    kp: float
    """1/s"""
    gain: float
    """N s/m"""
    volt: float
    """N per unit of a pulse"""


@dataclass(frozen=True)
class Table:
    """A recording; (N,) each, SI."""

    time: np.ndarray
    q_ref: np.ndarray
    q: np.ndarray
    force: np.ndarray
    pulse: np.ndarray

    @property
    def step(self) -> float:
        return float(np.median(np.diff(self.time)))


class Smoothly(Drive):
    """A drive whose references run straight between samples: against a feedback without pauses,
    references that are held would give a saw-tooth of 150 N that the rig's own sampled loop, which
    reads position and reference at the same moment, does not have."""

    base: Drive

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        return self.base.parameters(arm)

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return self.base.reference_channels(arm)

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        return replace(self.base.law(arm, p, values), interpolate=True)


def table(folder: Path, name: str) -> Table:
    """A recording of the benchmark."""
    d = pd.read_csv(folder / name)
    pulse = d["pulse"].to_numpy(float) if "pulse" in d else np.zeros(len(d))
    return Table(*(d[c].to_numpy(float) for c in ("t", "q_ref", "q", "force")), pulse)


def fitted(
    folder: Path, effects: Sequence[dict[str, Any]], diagnosed: bool = False,
    laws: Sequence[dict[str, Any]] = (),
) -> Outcome:  # fmt: skip
    """The scenario with these effects and own laws, estimated on the first recording, judged on
    both."""
    document = copy.deepcopy(read_scenario(SCENARIO).model_dump(exclude_unset=True))
    document["model"] |= {"effects": list(effects), "own": list(laws)}
    if not diagnosed:
        del document["diagnose"]
    judged = {"name": "pulses", "file": JUDGED, "columns": COLUMNS, "role": "validate"}
    document["recordings"] = [*document["recordings"], judged]
    scenario = check_scenario(document, "EMPS")
    return run_scenario(scenario, folder=SCENARIO.parent, data_folder=folder)


def force_errors(outcome: Outcome) -> dict[str, float]:
    """Recording -> |measured - modelled| / |measured| of the force, in per cent."""
    return {c.recording: 100.0 * c.channels[0].relative_error for c in outcome.comparisons}


def loop_of(data: Table) -> tuple[Loop, float]:
    """The loop's gains and the newtons per unit of a pulse (0 where there was none), from its own
    log by least squares; and the share of the logged force, in per cent, that they miss."""
    v = _rate(_smooth(data.q, data.step, MOTION_HZ), data.step)
    e, force, pulse = (
        _smooth(x, data.step, MOTION_HZ) for x in (data.q_ref - data.q, data.force, data.pulse)
    )
    columns = [e, -v, np.ones_like(e), *([pulse] if data.pulse.any() else [])]
    X = np.column_stack(columns)
    found = np.linalg.lstsq(X, force)[0]
    volt = float(found[3]) if len(found) > 3 else 0.0
    return Loop(float(found[0] / found[1]), float(found[1]), volt), percent(force, X @ found)


def inverse_model(data: Table, signs: bool) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (M, 4) of m, fv, fc and, with `signs`, the viscous friction's asymmetry (else the
    offset), and the force (M,): filtered and decimated as in the scenario."""
    q = _smooth(data.q, data.step, MOTION_HZ)
    v = _rate(q, data.step)
    last = np.abs(v) if signs else np.ones_like(v)
    columns = (_rate(v, data.step), v, np.sign(v), last)
    low = butter(8, 2.0 * FORCE_HZ * data.step, output="sos")
    found = [sosfiltfilt(low, x)[::DECIMATED] for x in (*columns, data.force)]
    return np.column_stack(found[:-1]), found[-1]


def model_of(values: dict[str, float], effects: Sequence[dict[str, Any]], drive: dict[str, Any]):  # type: ignore[no-untyped-def]
    """The slide at estimated values under another drive; effects stated with their values."""
    stated = [_with_values(effect, values) for effect in effects]
    model = base_model(check_scenario({
        "title": "EMPS", "arm": {"preset": "single_axis", "mass": values["m1"]}, "drive": drive,
        "model": {"level": "nonlinear", "effects": stated}, "identify": {"parameters": ["m1"]},
    }, "EMPS"))  # fmt: skip
    return replace(model, drive=Smoothly(base=model.drive))


def _with_values(effect: dict[str, Any], values: dict[str, float]) -> dict[str, Any]:
    knobs = [key for key in effect if key != "id"]
    held = {key: {"start": values[key], "vary": False} for key in knobs}
    return {"id": effect["id"], **held}


def closed_loop(
    values: dict[str, float], effects: Sequence[dict[str, Any]], loop: Loop, data: Table
) -> dict[str, float]:
    """Errors in per cent of a simulation in the loop, from the references alone.

    A known pulse enters the loop's output; that is a shift of the position's reference by
    pulse volt / (kp gain).
    """
    drive = {"kind": "cascade", "position_gains": [loop.kp], "velocity_gains": [loop.gain]}
    model = model_of(values, effects, drive)
    moved = data.q_ref + data.pulse * loop.volt / (loop.kp * loop.gain)
    task = _task(model, data, moved, 0, 0.0)
    motion = simulate_within(model, model.numbers(), task).trajectory
    q, u = motion.q[:, 0], motion.torque[:, 0]
    found = {"position": percent(data.q, q)}
    smooth = [_smooth(x, data.step, MOTION_HZ) for x in (data.q, q)]
    rates = [_rate(x, data.step) for x in smooth]
    found["velocity"] = percent(*rates)
    found["acceleration"] = percent(*(_rate(v, data.step) for v in rates))
    found["force"] = percent(*(_smooth(x, data.step, FORCE_HZ) for x in (data.force, u)))
    return found


def free_run(
    values: dict[str, float], effects: Sequence[dict[str, Any]], data: Table
) -> tuple[float, np.ndarray]:
    """Root mean square position error in m, and the error (N - FIRST,): from the recorded force.

    Place and speed at the start come from a straight line through the first samples.
    """
    model = model_of(values, effects, {"kind": "torque"})
    at = slice(0, FIRST)
    speed, place = np.polyfit(data.time[at] - data.time[FIRST], data.q[at], 1)
    task = _task(model, data, data.force, FIRST, float(speed), float(place))
    motion = simulate_within(model, model.numbers(), task).trajectory
    error = data.q[FIRST:] - motion.q[:, 0]
    return float(np.sqrt(np.mean(error**2))), error


def _task(  # type: ignore[no-untyped-def]
    model, data: Table, references: np.ndarray, first: int, speed: float, place: float | None = None
) -> Task:
    n = model.arm.coordinates
    start = at_rest(np.array([data.q[first] if place is None else place]), n)
    start[n] = speed
    time = data.step * np.arange(len(data.time) - first)
    return Task(time, np.array(references[first:, None]), start, start[None, :n])


def _smooth(x: np.ndarray, step: float, cutoff: float) -> np.ndarray:
    return np.asarray(sosfiltfilt(butter(4, 2.0 * cutoff * step, output="sos"), x))


def _rate(x: np.ndarray, step: float) -> np.ndarray:
    return np.asarray(np.gradient(x, step))


def percent(measured: np.ndarray, modelled: np.ndarray) -> float:
    """|measured - modelled| / |measured|, in per cent."""
    return float(100.0 * np.linalg.norm(measured - modelled) / np.linalg.norm(measured))
