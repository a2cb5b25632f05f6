"""Measured channels of a recording beside what a model makes of them, with channels corrected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..check.column_fault import ColumnFault
from ..check.equations import Answer, Equation, tip_equations
from ..check.measured_recording import MeasuredRecording
from ..check.signals import quiet_noise
from ..effects import effect
from ..effects.sizes import typical
from ..errors import InputError
from ..identify.predictor import Motion, Predictor
from ..identify.prepared_recording import Prepared, prepare
from ..identify.processing import TORQUE
from ..identify.setup import Setup, make_setup
from ..identify.unknown_gains import unknown_gains
from ..identify.unknowns import Unknown, Unknowns, collect_unknowns
from ..model import Model
from ..recording.clock import JITTER
from ..recording.recording import Recording
from ..scenario.schema import IdentifySpec
from ..sensors import sensor

COMPARED_SECONDS = 2.0
"""Of motion that are compared: periods enough of a slow arm, and soon simulated."""
MOVES = 0.01
"""Of its range: what a joint has left when the motion begins."""
LEAD = 40
"""Samples before the motion that are compared too."""
COMPARED_STEP = 1e-3
"""s, of a simulation, and at least between samples: a motion within a per cent."""
MOST_ROWS = 500
"""Samples of a channel that are compared."""
FRICTION = ("viscous_friction", "coulomb_friction")
SPREAD = 0.3
"""Of a stiffness or mass, and of the torques that friction takes: what is likely."""
DAMPED = 1e-3
"""s, of the damping of links: a resonance that is broad enough to be found."""


@dataclass(frozen=True)
class Comparison:
    """One recording and its model, with stiffness (or mass) and friction free."""

    recording: Recording
    model: Model
    setup: Setup
    unknowns: Unknowns
    stiffnesses: int
    """How many of the unknowns, the first, are stiffnesses, or else masses."""
    start: np.ndarray
    """(P,)"""
    spread: np.ndarray
    """(P,) of all but these."""
    known: np.ndarray
    """(P,) the start with what is identified."""
    states: int = 0
    """How many of the unknowns, the last, are of the state at the first sample."""
    zeros: tuple[str, ...] = ()
    """Channels whose zero the scenario states as unknown."""
    noise: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Channel -> (joints,) rms of its error per noise of each encoder, where these are followed."""

    @classmethod
    def of(
        cls, measured: MeasuredRecording, faults: Sequence[ColumnFault] = ()
    ) -> Comparison | None:
        """With faults taken back; None where the recording lacks what its model needs."""
        model, recording = measured.model, first_moves(measured, faults)
        if model is None or recording is None:
            return None
        model, spec = model.at_level("nonlinear"), measured.identify or IdentifySpec()
        try:
            setup = _setup(model, spec, recording)
            prepare(setup.model, recording, setup.outputs, setup.processing)
        except InputError:
            return None
        sizes = typical(model.arm)
        rubbing = setup.model.with_effects([effect(kind) for kind in FRICTION], {}, sizes)
        names, own = _stiffnesses(model), rubbing.effect_values
        damping = [f"tau{k + 1}" for k, modes in enumerate(model.arm.modes) if modes]
        stated = {n: p.value for n, p in model.parameters.items()}
        items = [Unknown(rubbing.parameters[n]) for n in (*names, *damping, *own)]
        start = [stated[n] for n in names] + [max(stated[n], DAMPED) for n in damping]
        spread = [1.0] * len(names) + [DAMPED] * len(damping) + [SPREAD * x for x in own.values()]
        free = IdentifySpec(initial_state=measured.begins_in_motion)
        items += (first := collect_unknowns(rubbing, free, [recording]).items)
        spread += [u.parameter.scale for u in first]
        start += [0.0] * (len(items) - len(start))
        pairs = zip(items, start, strict=True)
        known = [measured.values.get(item.parameter.name, value) for item, value in pairs]
        at = np.array(start), np.array(spread), np.array(known)
        unknowns, zeros = Unknowns(tuple(items)), spec.offsets
        found = cls(recording, rubbing, setup, unknowns, len(names), *at, len(first), zeros)
        return found if setup.model.steering is None else replace(found, noise=found.noise_gains())

    def noise_gains(self) -> dict[str, np.ndarray]:
        """By channel (joints,) how the noise of each encoder, that a servo follows, shows in it."""
        recording, rng = self.recording, np.random.default_rng(0)
        levels, asked = self._noise_levels(recording), [recording]
        for name, level in zip(self.encoders, levels, strict=True):
            x = recording[name] + level * rng.standard_normal(len(recording.time))
            asked.append(replace(recording, channels={**recording.channels, name: x}))
        plain, *others = self.answers([(r, self.start) for r in asked])
        gains = {}
        for k, e in enumerate(e for e in plain.equations if not e.tolerance):
            with np.errstate(invalid="ignore"):  # of an absurd torque, whose answer overflows
                apart = [np.std(a.equations[k].error - e.error) for a in others]
            gains[e.channel] = np.nan_to_num(np.array(apart) / levels, posinf=0.0)
        return gains

    @property
    def encoders(self) -> list[str]:
        """Channels of the joints."""
        return [f"theta{k + 1}" for k in range(self.model.arm.joints)]

    def _noise_levels(self, recording: Recording) -> np.ndarray:
        least = float(np.finfo(float).tiny)
        return np.array([max(quiet_noise(recording[n]), least) for n in self.encoders])

    def spread_at(self, centre: np.ndarray) -> np.ndarray:
        """(P,) by which the unknowns are likely to differ from a centre (P,)."""
        stiff = np.arange(len(centre)) < self.stiffnesses
        return np.where(stiff, SPREAD * centre, self.spread)

    @cached_property
    def lowest(self) -> np.ndarray:
        """(P,)"""
        return np.array([u.parameter.lower for u in self.unknowns.items])

    def answers(self, asked: Sequence[tuple[Recording, np.ndarray]]) -> list[Answer]:
        """What the model makes of recordings at vectors (P,), simulated side by side; once where
        what differs drives nothing."""
        prepared: dict[int, Prepared] = {}
        for r, _ in asked:
            if id(r) not in prepared:
                prepared[id(r)] = prepare(self.model, r, self.setup.outputs, self.setup.processing)
        place = {key: k for k, key in enumerate(prepared)}
        levels = {k: self._noise_levels(e.recording) for k, e in prepared.items() if self.noise}
        steps = int(np.ceil(self.recording.sample_time / COMPARED_STEP - JITTER))
        predictor = Predictor(list(prepared.values()), self.unknowns, {}, steps=max(steps, 1))
        keys = [_moved_by(prepared[id(r)], x) for r, x in asked]
        first = {key: k for k, key in reversed(list(enumerate(keys)))}
        requests = [(asked[k][1], [place[id(asked[k][0])]]) for k in first.values()]
        with np.errstate(all="ignore"):
            moved = dict(zip(first, predictor.trajectories(requests), strict=True))
            return [
                self._answer(prepared[id(r)], moved[key][0], levels.get(id(r)))
                for key, (r, _) in zip(keys, asked, strict=True)
            ]

    @cached_property
    def rows(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Of each output the samples that are compared, and those of the tip."""
        r = self.recording
        e = prepare(self.model, r, self.setup.outputs, self.setup.processing)
        pairs = zip(e.channels, e.counted.T, strict=True)
        tips = r.mask("z1") & r.mask("z2") if r.has("z1", "z2") else np.zeros(0, dtype=bool)
        return {name: _thinned(counted) for (name, _), counted in pairs}, _thinned(tips)

    def _answer(self, e: Prepared, motion: Motion, levels: np.ndarray | None) -> Answer:
        y, (rows, tips) = e.processed(e.readings(*motion)), self.rows
        measured = np.where(e.counted, e.measured, np.nan)
        free = self._free_terms(e)
        shown = {} if levels is None else self.noise
        unknown = unknown_gains(e.model, e.outputs, [e.recording])
        noise = {n: float(np.linalg.norm(gains * levels)) for n, gains in shown.items()}
        compared = []
        for i, (name, _) in enumerate(e.channels):
            at = rows[name]
            if _moves(measured[at, i]):
                time, both = e.time[at], (measured[at, i], y[at, i])
                noisy = noise.get(name, 0.0)
                compared.append(Equation(name, time, *both, free[i], noisy, name in unknown))
        return Answer((*compared, *tip_equations(motion[0], e, tips, self.zeros)))

    def _free_terms(self, e: Prepared) -> list[int]:
        """Of each channel: see `Equation.free`."""
        loose = self.model.steering is None
        drifts = [s.drifts and loose for s in e.outputs for _ in s.channels(e.model.arm)]
        names = [name for name, _ in e.channels]
        return [2 if d else int(n in self.zeros) for d, n in zip(drifts, names, strict=True)]


def _thinned(counted: np.ndarray) -> np.ndarray:
    """Of the samples that count (N,) no more than needed: neighbours are alike."""
    rows = np.flatnonzero(counted)
    return rows[:: max(len(rows) // MOST_ROWS, 1)]


def _moves(x: np.ndarray) -> bool:
    """Whether a channel (N,) has samples that differ."""
    x = x[np.isfinite(x)]
    return bool(len(x) and x.min() < x.max())


def _moved_by(e: Prepared, x: np.ndarray) -> tuple[object, ...]:
    """What a recording's simulated motion at a vector (P,) depends on."""
    task = e.task
    before = b"" if task.before is None else task.before.tobytes()
    arrays = (task.references, task.start, task.schedule, x)
    return (e.recording.sample_time, before, *(a.tobytes() for a in arrays))


def _setup(model: Model, spec: IdentifySpec, recording: Recording) -> Setup:
    """As an identification compares the recording; torques up to where the encoders show motion,
    or behind the stated filter where they show it everywhere."""
    direct = spec.model_copy(update={"offsets": (), "output": None})
    own = direct.model_copy(update={"filter": None, "output_filter": None})
    setup, torque = make_setup(model, own, [recording]), sensor(TORQUE)
    if setup.model.steering is None and torque.direct(recording, model.arm):
        return replace(setup, outputs=(*setup.outputs, torque))
    if setup.model.steering is None or setup.processing.torque_filter is not None:
        return setup
    return make_setup(model, direct, [recording])


def _stiffnesses(model: Model) -> list[str]:
    """The stiffness of each segment that bends, or else the masses."""
    stiff = [f"EI{k + 1}" for k, modes in enumerate(model.arm.modes) if modes]
    return stiff or [f"m{k + 1}" for k in range(model.arm.joints)]


def first_moves(measured: MeasuredRecording, faults: Sequence[ColumnFault]) -> Recording | None:
    """The first COMPARED_SECONDS of motion on an even clock, with faults taken back; None without
    encoders."""
    joints = measured.names("theta#")
    if not joints:
        return None
    names = [n for n in measured.channels if measured.has(n)]
    channels, counted = ({n: f(n) for n in names} for f in (measured.sampled, measured.near))
    whole = Recording(
        measured.name, measured.grid, channels, counted=counted,
        logger_filters=measured.logger_filters, camera=measured.camera,
        unknown_gains=measured.unknown_gains,
    )  # fmt: skip
    for fault in faults:
        whole = fault.corrected(whole)
    q = np.column_stack([whole[n] for n in joints])
    away = np.max(np.abs(q - q[0]) / (np.ptp(q, axis=0) + 1e-300), axis=1)
    first = max(int(np.argmax(away > MOVES)) - LEAD, 0)
    every = max(int(COMPARED_STEP / measured.step + JITTER), 1)
    return whole.rows(slice(first, first + LEAD + int(COMPARED_SECONDS / measured.step), every))
