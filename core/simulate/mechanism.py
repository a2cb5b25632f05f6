"""The arm of a model in plain numbers: what another simulator needs to build it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from ..arm import slots
from ..effects.effect import Effect
from ..forces.compiled import compile_law
from ..forces.element import Element, linear_matrices
from ..model import Model, Numbers
from ..results.outcome import Link, Mechanism, PresentEffect
from ..simulate.posture import posture

FREQUENCIES = 3
BENT_ELBOW = np.pi / 2
"""rad: every joint but the first at a right angle, where no two segments swing alike."""


def mechanism(model: Model, values: Mapping[str, float]) -> Mechanism:
    """The arm of a model in SI units, with the linear damping and the dry friction of its joints,
    and its effects with their sizes. `values`: name -> value, SI; what is missing is as the model
    states it."""
    estimated = {name: value for name, value in values.items() if name in model.parameters}
    numbers = model.numbers(estimated)
    place = _bent(model)
    joints = range(model.arm.joints)
    gravity = [float(numbers.p[slots.gravity_slot(len(joints), i)]) for i in (0, 1)]
    base = float(numbers.p[slots.base_slot(len(joints))])
    turning = [float(numbers.p[i]) for i in slots.pedestal_slots(len(joints))]
    return Mechanism(
        links=tuple(_link(model, numbers, k) for k in joints),
        gravity=(gravity[0], gravity[1]),
        base_stiffness=base or None,
        pedestal=(turning[0], turning[1]) if turning[0] else None,
        frequencies=_frequencies(model, numbers, place),
        posture=tuple(float(x) for x in place),
        effects=tuple(_present(effect, model, numbers, estimated) for effect in model.effects),
    )


def _bent(model: Model) -> np.ndarray:
    """(nj,) turning joints after the first at a right angle, slides at zero."""
    turning = [s.joint == "revolute" for s in model.arm.segments]
    return np.array([BENT_ELBOW if k and turns else 0.0 for k, turns in enumerate(turning)])


def _frequencies(model: Model, numbers: Numbers, place: np.ndarray) -> tuple[float, ...]:
    """Hz of M v'' + K v = 0 with the motors held; gravity bends nothing here."""
    nj, p = model.arm.joints, numbers.p.copy()
    p[slots.gravity_slot(nj, 0) : slots.gravity_slot(nj, 2)] = 0.0
    at = posture(model, place, Numbers(p, numbers.law))
    M, K = at.M[nj:, nj:], at.K[nj:, nj:]
    if not len(M):
        return ()
    squares = scipy.linalg.eigh(K, M, eigvals_only=True)[:FREQUENCIES]
    return tuple(float(f) for f in np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))


def _link(model: Model, numbers: Numbers, k: int) -> Link:
    segment, p = model.arm.segments[k], numbers.p
    elements = [e for e in numbers.elements if _at_joint(e, k)]
    n = model.arm.coordinates

    def of(which: int) -> float:
        return float(p[slots.slot(k, which)])

    return Link(
        length=of(slots.LENGTH),
        mass=of(slots.MASS),
        EI=of(slots.STIFFNESS),
        modes=segment.modes,
        damping_time=of(slots.DAMPING_TIME),
        tip_mass=of(slots.TIP_MASS),
        tip_inertia=of(slots.TIP_INERTIA),
        joint=segment.joint,
        axis_angle=of(slots.AXIS_ANGLE),
        on_ground=k == 0 or segment.mount == "ground",
        hub_inertia=of(slots.HUB_INERTIA),
        rotor_inertia=of(slots.ROTOR_INERTIA),
        joint_stiffness=of(slots.TWIST_STIFFNESS) or None,
        joint_damping=float(linear_matrices(elements, np.zeros(n))[1][k, k]),
        dry_friction=sum((_level(e) for e in elements if is_dry(e)), 0.0),
        gain=_velocity_gain(numbers, k),
        limit=float(numbers.law.limit[k]) if np.isfinite(numbers.law.limit[k]) else None,
        centre=None if segment.modes else (of(slots.CENTRE_ALONG), of(slots.CENTRE_ACROSS)),
        inertia=0.0 if segment.modes else of(slots.INERTIA),
    )


def _at_joint(element: Element, k: int) -> bool:
    """Whether it is a torque at the motor of joint k (from 0) that sees nothing but that joint."""
    if element.at_tip or len(element.directions) != 1:
        return False
    return bool(np.array_equal(element.directions[0], np.eye(len(element.directions[0]))[k]))


def is_dry(element: Element) -> bool:
    """Whether its force is one level against the motion, at any speed and load."""
    seen = (*element.law.x, *element.law.v)
    return element.law.bristle and not element.written and not element.law.forces[0].has(*seen)


def _level(element: Element) -> float:
    """N m (N): the mean over both directions."""
    law, values = compile_law(element.law), np.array(element.values, dtype=float)
    zero = np.zeros(1)
    backward, forward = (float(law(zero, zero, np.array([w]), values)[0]) for w in (-1.0, 1.0))
    return 0.5 * (backward - forward)


def _velocity_gain(numbers: Numbers, k: int) -> float | None:
    """Of u_k = gain (reference_k - rate_k); None where the drive does anything else."""
    law = numbers.law
    if law.states or np.any(law.P) or law.references != len(law.V):
        return None
    gain = float(law.R[k, k])
    alone = np.zeros_like(law.V[k])
    alone[k] = gain
    only = np.array_equal(law.V[k], alone) and np.array_equal(law.R[k], alone[: law.references])
    return gain if only and gain > 0.0 else None


def _present(
    effect: Effect, model: Model, numbers: Numbers, estimated: Mapping[str, float]
) -> PresentEffect:
    values = {**model.effect_values, **estimated}
    named = [(name, p) for name, p in model.parameters.items() if model.origin(name) == effect.kind]
    return PresentEffect(
        kind=effect.kind,
        title=effect.title,
        sizes=tuple((name, float(values.get(name, p.value)), p.unit) for name, p in named),
        linear=effect.linear,
        acts_on=_acts_on(effect, model, effect.elements(model.arm, numbers.p, values)),
    )


def _acts_on(effect: Effect, model: Model, elements: Sequence[Element]) -> str:
    """By what the effect does, so that an effect that is added later needs no word here."""
    kind = type(effect)
    if kind.sensed is not Effect.sensed or kind.started is not Effect.started:
        return "sensor"
    if elements:
        at_joints = all(any(_at_joint(e, k) for k in range(model.arm.joints)) for e in elements)
        if at_joints and all(is_dry(e) for e in elements):
            return "dry"
        return "damping" if effect.linear and at_joints else "force"
    if kind.law is not Effect.law or effect.location == "drive":
        return "drive"
    return "arm"
