"""What can be hidden in a rig: one function per effect, named by its id.

Each takes the arm, the rig so far and a size between 0 and about 1 (a share of what the arm's loops
can do), and returns the rig and the truth: parameter -> value in SI units, in the names under which
the effect's sizes are published. What stands in no published name shapes the effect and is not
judged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tests.programs.mujoco.wide_arms import AMPLITUDE, Arm
from tests.programs.mujoco.wide_rig import Rig

Hidden = tuple[Rig, dict[str, float]]
SIGNS = np.array([1.0, -1.0, 1.0])


def _motors(rig: Rig, **columns: Sequence[float]) -> Rig:
    """The rig with other motors: each keyword holds a value for every joint."""
    motors = tuple(
        replace(m, **{name: float(values[i]) for name, values in columns.items()})
        for i, m in enumerate(rig.plant.motors)
    )
    return replace(rig, plant=replace(rig.plant, motors=motors))


def _plant(rig: Rig, **changes: Any) -> Rig:
    return replace(rig, plant=replace(rig.plant, **changes))


def _named(name: str, values: Sequence[float]) -> dict[str, float]:
    return {f"{name}{k + 1}": float(v) for k, v in enumerate(values)}


def _gains(arm: Arm) -> np.ndarray:
    return np.array(arm.gains)


def viscous_friction(arm: Arm, rig: Rig, size: float) -> Hidden:
    sizes = size * _gains(arm)
    return _motors(rig, viscous=sizes), _named("fv", sizes)


def coulomb_friction(arm: Arm, rig: Rig, size: float) -> Hidden:
    sizes = size * arm.torques
    return _motors(rig, coulomb=sizes), _named("fc", sizes)


def stribeck_friction(arm: Arm, rig: Rig, size: float) -> Hidden:
    """As high again at standstill as the Coulomb level below it, gone at 0.05 rad/s."""
    level, extra = size * arm.torques, size * arm.torques

    def law(x: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        return level + extra * np.exp(-((v / 0.05) ** 2))

    return replace(rig, friction=law), _named("fc", level) | _named("fb", extra)


def load_friction(arm: Arm, rig: Rig, size: float) -> Hidden:
    def law(x: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        return size * np.abs(u)

    sizes = [size] * arm.joints
    return replace(rig, friction=law), _named("ld", sizes) | _named("lb", sizes)


def friction_asymmetry(arm: Arm, rig: Rig, size: float) -> Hidden:
    sizes = size * _gains(arm) * SIGNS[: arm.joints]
    return rig.pushed(lambda x, v, u: -sizes * np.abs(v)), _named("fa", sizes)


def torque_offset(arm: Arm, rig: Rig, size: float) -> Hidden:
    sizes = size * arm.torques * SIGNS[: arm.joints]
    return rig.pushed(lambda x, v, u: sizes), _named("to", sizes)


def torque_ripple(arm: Arm, rig: Rig, size: float) -> Hidden:
    """200 waves per radian, as of a gear's teeth."""
    sizes = size * arm.torques
    truth = _named("ra", sizes) | _named("nr", [200.0] * arm.joints)
    return rig.pushed(lambda x, v, u: sizes * np.cos(200.0 * x)), truth


def tip_payload(arm: Arm, rig: Rig, size: float) -> Hidden:
    """A box 6 cm wide, of a share of the last segment's mass, with the inertia that it has."""
    mass = size * arm.beams[-1].mass
    rig = replace(_plant(rig, tip_mass=mass), tip_inertia=mass * 0.06**2 / 6.0)
    return rig, {f"mt{arm.joints}": mass}


def joint_elasticity(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in mrad of twist at the loops' torque."""
    stiffness = arm.torques / (1e-3 * size)
    return _motors(rig, spring=stiffness), _named("c", 1.0 / stiffness)


def backlash(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in mrad each way, behind teeth that give way by a tenth of a milliradian."""
    rig = _motors(rig, spring=arm.torques / 1e-4)
    sizes = [1e-3 * size] * arm.joints
    return replace(rig, gaps=tuple(sizes)), _named("bl", sizes)


def rotor_inertia(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` times as much as stated, on top of it."""
    sizes = (1.0 + size) * np.array(arm.rotors)
    return _motors(rig, inertia=sizes), _named("Jh", sizes)


def drive_saturation(arm: Arm, rig: Rig, size: float) -> Hidden:
    """Of the torque that a full change of the reference asks for, less `size` of it."""
    sizes = 2.0 * (1.0 - size) * arm.torques
    return _motors(rig, limit=sizes), _named("ul", sizes)


def drive_lag(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in ms."""
    return replace(rig, lag=1e-3 * size), {"tl": 1e-3 * size}


def drive_gain(arm: Arm, rig: Rig, size: float) -> Hidden:
    sizes = _gains(arm) * (1.0 + size * SIGNS[: arm.joints])
    return _motors(rig, gain=sizes), _named("lambda", sizes)


def gravity_tilt(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in m/s²."""
    return _plant(rig, gravity=(size, -0.5 * size)), {"g1": size, "g2": -0.5 * size}


def structural_damping(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` is the damping ratio of the first segment, clamped."""
    beam = arm.beams[0]
    frequency = 3.516 * np.sqrt(beam.EI / (beam.mass * beam.length**3))
    time = float(2.0 * size / frequency)
    return _plant(rig, damping_time=time), _named("tau", [time] * arm.joints)


def cubic_stiffness(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` of the linear stiffness at the deflection under the loops' torque."""
    stiffness = np.array([3.0 * b.EI / b.length**3 for b in arm.beams])
    lengths = np.array([b.length for b in arm.beams])
    sizes = size * stiffness / (arm.torques / lengths / stiffness) ** 2
    return replace(rig, cubic=tuple(sizes.tolist())), _named("k3", sizes)


def base_compliance(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` is the inverse of the frequency, in units of 10 Hz, of the arm as a dead mass."""
    mass = sum(b.mass for b in arm.beams)
    compliance = float(1.0 / (mass * (2.0 * np.pi * 10.0 / size) ** 2))
    return replace(rig, base_compliance=compliance), {"cb": compliance}


def base_rotation(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` is the inverse of the frequency, in units of 10 Hz, of the stretched arm; a third of
    its inertia turns with the base."""
    load = sum(b.mass for b in arm.beams) * arm.reach**2 / 3.0
    compliance = float(1.0 / (load * (2.0 * np.pi * 10.0 / size) ** 2))
    return replace(rig, pedestal=(compliance, float(load / 3.0))), {
        "cp": compliance, "Jp": float(load / 3.0),
    }  # fmt: skip


def air_drag(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` of the first loop's torque at the reference's speed."""
    drag = float(size * arm.torques[0] / (arm.reach * (AMPLITUDE * arm.reach) ** 2))
    return replace(rig, drag=drag), {"cd": drag}


def link_mass_error(arm: Arm, rig: Rig, size: float) -> Hidden:
    beams = tuple(
        replace(b, mass=float(b.mass * (1.0 + size * s)))
        for b, s in zip(arm.beams, SIGNS[: arm.joints], strict=True)
    )
    return _plant(rig, beams=beams), _named("m", [b.mass for b in beams])


def camera_delay(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in ms."""
    return _plant(rig, camera_delay=1e-3 * size), {"td": 1e-3 * size}


def sensor_lag(arm: Arm, rig: Rig, size: float) -> Hidden:
    """`size` in ms, of the camera."""
    return replace(rig, camera_lag=1e-3 * size), {"ts": 1e-3 * size}


def camera_misalignment(arm: Arm, rig: Rig, size: float) -> Hidden:
    return replace(rig, camera_angle=size, camera_scale=-0.5 * size), {"ca": size, "cs": -size / 2}


def encoder_offset(arm: Arm, rig: Rig, size: float) -> Hidden:
    offsets = (0.0, *([size] * (arm.joints - 1)))
    truth = {f"eo{k + 1}": size for k in range(1, arm.joints)}
    return replace(rig, encoder_offsets=offsets), truth


Effect = Callable[[Arm, Rig, float], Hidden]
EFFECTS: dict[str, Effect] = {
    make.__name__: make
    for make in (
        viscous_friction, coulomb_friction, stribeck_friction, load_friction, friction_asymmetry,
        torque_offset, torque_ripple, tip_payload, joint_elasticity, backlash, rotor_inertia,
        drive_saturation, drive_lag, drive_gain, gravity_tilt, structural_damping, cubic_stiffness,
        base_compliance, base_rotation, air_drag, link_mass_error, camera_delay, sensor_lag,
        camera_misalignment, encoder_offset,
    )
}  # fmt: skip
