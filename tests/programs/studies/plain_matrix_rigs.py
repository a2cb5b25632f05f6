"""Random rigs of the plain matrix: arm, drive, sensors and the recordings that an engineer makes.

Nothing here knows what is hidden: the machine that moves is handed in as a model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import eigh

from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.motion import Task, at_rest
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.trajectory import Trajectory
from tests.helpers import simulate_fixed

SEGMENTS = (1, 2, 2, 3)
"""How many segments rigs have: two is the usual arm."""

MOST_BENT = 0.03
"""Of a segment's length (gauges read that share): the largest deflection of the healthy arm. Beyond
some per cent the foreshortening to second order is no longer the beam's, and one spares the rig."""

RATES_HZ = (200.0, 250.0, 500.0, 1000.0)

MOST_ROWS = 9000
"""Of all recordings that are fitted, so that a case takes seconds."""

VELOCITY_REFERENCE = 0.3
"""rad/s, as in the paper."""

STEPS_HZ = 4000.0
"""Steps per second where only the size of an effect is sought."""

SKETCHED = 4
"""Recordings on which effects are sized and weighed against stand-ins: more only tell more."""

EXACT = 1e-7
"""m (rad): the quietest sensor's noise, 2e-6, over the square root of a thousand samples."""

DIGITS = 6
"""Significant digits in the stated geometry, masses and gains."""


@dataclass(frozen=True)
class Rig:
    """One bench with its campaign; all that is random in it comes from `drawn`."""

    segments: tuple[Mapping[str, float], ...]
    """Truth, as tables of `[[arm.segments]]`."""
    starts: tuple[float, ...]
    """Factors by which the stated stiffness of each segment is wrong."""
    drive: Mapping[str, Any]
    kinds: tuple[str, ...]
    """Of sensors beside the encoders: z, deflection."""
    noise: Mapping[str, float]
    """Kind of sensor -> standard deviation of its white noise, SI; that of the encoder comes on
    top of its steps."""
    encoder_step: float
    """rad"""
    rate: float
    """Hz"""
    seconds: float
    hold: float
    """s, how long the excitation keeps a level."""
    cutoff: float | None
    """Hz, of the filter that the scenario states."""
    postures: tuple[tuple[float, ...], ...]
    """rad, where each recording starts; the last is for validation."""
    excitations: tuple[str, ...]
    amplitudes: tuple[float, ...]
    """Per joint, rad/s or N m."""
    seed: int

    @property
    def joints(self) -> int:
        return len(self.segments)

    @property
    def torque_driven(self) -> bool:
        return bool(self.drive["kind"] == "torque")

    def document(self, true: bool = False) -> dict[str, Any]:
        """The plain scenario: arm, drive, files, parameters; `true`: with the true stiffness."""
        factors = (1.0,) * self.joints if true else self.starts
        tables = [
            {**s, "EI": _rounded(s["EI"] * f, None if true else DIGITS)}
            for s, f in zip(self.segments, factors, strict=True)
        ]
        identify: dict[str, Any] = {"parameters": [f"EI{k + 1}" for k in range(self.joints)]}
        if self.cutoff is not None:
            identify["filter"] = {"cutoff_hz": self.cutoff}
        count = len(self.postures)
        return {
            "title": "A plain scenario",
            "arm": {"segments": tables},
            "drive": dict(self.drive),
            "identify": identify,
            "diagnose": {"max_effects": 6},
            "recordings": [
                {"file": f"r{i + 1}.csv", "role": "validate" if i == count - 1 else "estimate"}
                for i in range(count)
            ],
        }

    @cached_property
    def healthy(self) -> Model:
        """The machine with nothing hidden, full equations."""
        scenario = Scenario.model_validate(self.document(true=True))
        return base_model(scenario).at_level("nonlinear")

    def task(self, machine: Model, i: int) -> Task:
        """What recording i asks of a machine."""
        dt = 1.0 / self.rate
        options = {"highest_hz": 0.4 / self.hold} if self.excitations[i] == "chirp" else {}
        spec = SimulateSpec(
            theta=self.postures[i], seconds=self.seconds, seed=self.seed + i, sample_time=dt,
            excitation=self.excitations[i], amplitude=1.0, hold=self.hold, options=options,
        )  # fmt: skip
        task, _ = make_task(machine, spec, f"r{i + 1}")
        return replace(task, references=task.references * np.array(self.amplitudes))

    def roughly(self, machine: Model, i: int) -> Trajectory:
        """The motion of recording i with a fixed number of steps, extrapolated: a soft base swings
        faster than plain steps follow."""
        steps = int(np.ceil(STEPS_HZ / self.rate))
        return simulate_fixed(machine, machine.numbers(), self.task(machine, i), 2 * steps)

    def exactly(self, machine: Model, i: int) -> Trajectory:
        """The motion of recording i, exact beside the noise even of the mean of its samples."""
        task = self.task(machine, i)
        return simulate_within(machine, machine.numbers(), task, EXACT).trajectory

    def recording(self, machine: Model, i: int, motion: Trajectory) -> Recording:
        """What the rig would write without noise and steps."""
        role = "validate" if i == len(self.postures) - 1 else "estimate"
        seen = self.read(machine, self.task(machine, i), motion)
        return replace(seen, name=f"r{i + 1}", role=role, source="matrix")

    def read(self, machine: Model, task: Task, motion: Trajectory) -> Recording:
        """The references of a task beside what the rig's sensors read of its motion."""
        names = machine.drive.reference_channels(machine.arm)
        channels = {name: task.references[:, k] for k, name in enumerate(names)}
        for kind in ("encoder", *self.kinds):
            one = sensor(kind)
            y = machine.sensed(kind, np.array(one.measure(motion)), task.sample_time, {})
            channels |= {c.name: y[:, k] for k, c in enumerate(one.channels(machine.arm))}
        return Recording("r", task.time, channels)

    def sketched(self, machine: Model) -> list[Recording]:
        """The first SKETCHED recordings without noise, roughly simulated."""
        which = range(min(len(self.postures) - 1, SKETCHED))
        return [self.recording(machine, i, self.roughly(machine, i)) for i in which]

    def recordings(self, machine: Model) -> list[Recording]:
        """All recordings without noise; the last is for validation."""
        which = range(len(self.postures))
        return [self.recording(machine, i, self.exactly(machine, i)) for i in which]

    def measured(self, clean: Sequence[Recording], seed: int) -> list[Recording]:
        """With the sensors' noise, and encoders that count."""
        rng = np.random.default_rng([self.seed, seed, 7])
        return [self._measured(r, rng) for r in clean]

    def _measured(self, r: Recording, rng: np.random.Generator) -> Recording:
        channels = dict(r.channels)
        for kind in ("encoder", *self.kinds):
            for c in sensor(kind).channels(self.healthy.arm):
                y = channels[c.name] + self.noise[kind] * rng.standard_normal(len(r.time))
                if kind == "encoder":
                    y = self.encoder_step * np.round(y / self.encoder_step)
                channels[c.name] = y
        return replace(r, channels=channels)


def drawn(seed: int, wants: str = "") -> Rig:
    """A random rig; `wants`: a stand-in's name, for which the rig has what it needs."""
    rng = np.random.default_rng([seed, 1])
    joints = int(rng.choice(SEGMENTS))
    torque = bool(rng.random() < 0.25)
    if wants:
        joints, torque = max(joints, 2), wants == "current_constant"
    kinds = tuple(k for k, share in (("z", 0.65), ("deflection", 0.3)) if rng.random() < share)
    if wants == "gauge_scale":
        kinds = ("z", "deflection")
    segments = _segments(rng, joints)
    rate, count = float(rng.choice(RATES_HZ)), int(rng.integers(3, 11))
    wrong = 0.7 ** rng.choice([-1.0, 1.0], joints)
    if rng.random() < 0.1:
        wrong = np.full(joints, 4.0 ** rng.choice([-1.0, 1.0]))
    cutoff = float(rng.choice([30.0, 50.0, 80.0])) if torque or rng.random() < 1 / 3 else None
    rig = Rig(
        segments=segments,
        starts=tuple(float(x) for x in wrong),
        drive={"kind": "torque"},
        kinds=kinds,
        noise={
            "encoder": 2e-6,
            "z": _between(rng, 2e-5, 2e-4),
            "deflection": _between(rng, 1e-5, 1e-4),
        },  # fmt: skip
        encoder_step=2.0 * np.pi / 2.0 ** int(rng.integers(16, 21)),
        rate=rate,
        seconds=1.0,
        hold=0.02,
        cutoff=cutoff,
        postures=tuple(_posture(rng, joints) for _ in range(count + 1)),
        excitations=tuple(
            str(rng.choice(["prbs_balanced", "prbs", "chirp"])) for _ in range(count + 1)
        ),
        amplitudes=(1.0,) * joints,
        seed=1000 * seed,
    )
    return _driven(rig, rng, torque, wants)


def _driven(rig: Rig, rng: np.random.Generator, torque: bool, wants: str) -> Rig:
    """With a drive that suits the arm, and an excitation that moves it well and spares it."""
    arm = rig.healthy
    n, p = arm.arm.coordinates, arm.numbers().p
    middle = at_rest(np.array(rig.postures[0]), n)[:n]
    M = arm.compiled.mass_matrix(middle, p)
    K, _ = arm.compiled.linear_matrices(middle, p)
    e = slice(rig.joints, None)
    lowest = float(np.sqrt(np.abs(eigh(K[e, e], M[e, e], eigvals_only=True)[0])) / (2.0 * np.pi))
    hold = float(np.clip(0.15 / lowest, 0.01, 0.1))
    hold = max(round(hold * rig.rate), 2) / rig.rate
    count = len(rig.postures) - 1
    seconds = float(np.clip(6.0 / lowest, 1.0, min(3.0, max(1.0, MOST_ROWS / rig.rate / count))))
    inertia = np.diag(M)[: rig.joints]
    drive: dict[str, Any] = {"kind": "torque"}
    amplitudes = inertia * VELOCITY_REFERENCE / hold
    if wants == "current_constant":
        constants = [_rounded(x, 3) for x in rng.uniform(0.5, 5.0, rig.joints)]
        drive["torque_constants"] = constants
        amplitudes = amplitudes / np.array(constants)
    elif not torque:
        gains = inertia * rng.uniform(10.0, 30.0, rig.joints)
        drive = {"kind": "velocity_loop", "gains": [_rounded(x, 2) for x in gains]}
        amplitudes = np.full(rig.joints, VELOCITY_REFERENCE)
    sized = replace(
        rig, drive=drive, hold=hold, seconds=round(seconds, 2),
        amplitudes=tuple(float(x) for x in amplitudes),
    )  # fmt: skip
    return replace(sized, amplitudes=_spared(sized))


def _spared(rig: Rig) -> tuple[float, ...]:
    """Amplitudes at which no segment of the healthy arm bends too far."""
    worst = 0.0
    for i in range(min(len(rig.postures), 3)):
        bent = np.array(sensor("deflection").measure(rig.roughly(rig.healthy, i)))
        worst = max(worst, float(np.nanmax(np.abs(bent))))
    share = min(1.0, MOST_BENT / max(worst, 1e-12))
    return tuple(_rounded(a * share, 3) for a in rig.amplitudes)


def _segments(rng: np.random.Generator, joints: int) -> tuple[dict[str, float], ...]:
    """Lighter and softer towards the tip, as arms are built; stiffness over two decades."""
    found = []
    mass, EI = _between(rng, 2.0, 8.0), _between(rng, 50.0, 5000.0)
    for _ in range(joints):
        length = float(rng.uniform(0.3, 0.8))
        hub = 0.1 * mass * length**2 * rng.uniform(0.5, 1.5)
        table = {"length": length, "mass": mass, "EI": EI, "hub_inertia": hub}
        found.append({k: _rounded(v, DIGITS) for k, v in table.items()} | {"modes": 1})
        mass, EI = mass * rng.uniform(0.4, 0.9), EI * rng.uniform(0.2, 1.0)
    return tuple(found)


def _posture(rng: np.random.Generator, joints: int) -> tuple[float, ...]:
    first = (float(rng.uniform(-0.5, 0.5)),)
    rest = rng.uniform(0.3, 2.6, joints - 1) * rng.choice([-1.0, 1.0], joints - 1)
    return first + tuple(float(x) for x in rest)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _rounded(x: float, digits: int | None) -> float:
    return float(x) if digits is None else float(f"{x:.{digits}g}")
