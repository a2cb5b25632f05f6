"""The wide cases: every effect in three sizes, pairs, triples, and nothing, on four arms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from tests.programs.mujoco.wide_arms import ARMS, Arm
from tests.programs.mujoco.wide_effects import EFFECTS
from tests.programs.mujoco.wide_rig import Rig

SIZES: Mapping[str, tuple[float, float, float]] = {
    "viscous_friction": (0.02, 0.05, 0.12),
    "coulomb_friction": (0.03, 0.08, 0.2),
    "stribeck_friction": (0.03, 0.06, 0.12),
    "load_friction": (0.1, 0.2, 0.4),
    "friction_asymmetry": (0.02, 0.05, 0.12),
    "torque_offset": (0.03, 0.08, 0.2),
    "torque_ripple": (0.04, 0.08, 0.2),
    "tip_payload": (0.03, 0.08, 0.2),
    "joint_elasticity": (0.7, 2.0, 5.0),
    "backlash": (0.5, 1.5, 4.0),
    "rotor_inertia": (0.5, 2.0, 5.0),
    "drive_saturation": (0.2, 0.4, 0.6),
    "drive_lag": (1.0, 3.0, 6.0),
    "drive_gain": (-0.1, 0.15, 0.3),
    "gravity_tilt": (0.1, 0.2, 0.5),
    "structural_damping": (0.01, 0.03, 0.08),
    "cubic_stiffness": (0.3, 1.0, 3.0),
    "base_compliance": (0.3, 0.6, 1.0),
    "air_drag": (0.05, 0.15, 0.5),
    "link_mass_error": (0.04, 0.1, 0.2),
    "camera_delay": (4.0, 8.0, 20.0),
    "sensor_lag": (3.0, 6.0, 15.0),
    "camera_misalignment": (0.003, 0.01, 0.03),
    "encoder_offset": (0.003, 0.01, 0.03),
    "base_rotation": (0.3, 0.6, 1.0),
}
"""Small, middle and large; what a size means stands with each effect."""

SEVERAL = (
    ("paper", ("coulomb_friction", "camera_delay")),
    ("unequal", ("viscous_friction", "tip_payload")),
    ("three", ("joint_elasticity", "coulomb_friction")),
    ("unequal", ("base_compliance", "structural_damping")),
    ("one", ("drive_lag", "tip_payload")),
    ("paper", ("backlash", "viscous_friction")),
    ("unequal", ("gravity_tilt", "coulomb_friction")),
    ("one", ("joint_elasticity", "camera_delay")),
    ("paper", ("drive_saturation", "structural_damping")),
    ("three", ("rotor_inertia", "viscous_friction")),
    ("unequal", ("coulomb_friction", "tip_payload", "camera_delay")),
    ("paper", ("viscous_friction", "joint_elasticity", "structural_damping")),
    ("one", ("coulomb_friction", "tip_payload", "sensor_lag")),
    ("three", ("viscous_friction", "tip_payload", "camera_delay")),
    ("unequal", ("torque_offset", "structural_damping", "camera_delay")),
)
"""Each in its middle size."""

FOR_SMALL = ("paper", "three")
"""In turn; the other sizes are hidden in an unequal arm and in one segment."""
NEEDS_TWO = ("encoder_offset",)
LATER = ("base_rotation",)
"""Added when places in the order had been taken: the sample takes every tenth case."""


@dataclass(frozen=True)
class Case:
    """One set of recordings: the arm, and effect -> size."""

    arm: str
    hidden: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        said = "+".join(f"{effect}={size:g}" for effect, size in self.hidden)
        return f"{self.arm}/{said or 'nothing'}"

    def made(self) -> tuple[Arm, Rig, dict[str, dict[str, float]]]:
        """The arm as it is stated, the rig as it is, and the truth by effect."""
        arm = ARMS[self.arm]
        rig, truth = Rig(arm.plant), {}
        for effect, size in self.hidden:
            rig, truth[effect] = EFFECTS[effect](arm, rig, size)
        return arm, rig, truth


def _arm_for(effect: str, size: int, turn: int) -> str:
    if size == 1:
        return "unequal"
    if size == 2 and effect not in NEEDS_TWO:
        return "one"
    return FOR_SMALL[turn % len(FOR_SMALL)]


def _ordered() -> Iterator[Case]:
    """The middle sizes first, so that a part of the study says something of every effect."""
    singles = {
        size: [
            Case(_arm_for(effect, size, turn), ((effect, sizes[size]),))
            for turn, (effect, sizes) in enumerate(SIZES.items())
        ]
        for size in range(3)
    }
    several = [
        Case(arm, tuple((effect, SIZES[effect][1]) for effect in effects))
        for arm, effects in SEVERAL
    ]
    first = [*(Case(name) for name in ARMS), *singles[1], *several, *singles[2], *singles[0]]
    yield from sorted(first, key=lambda case: any(effect in LATER for effect, _ in case.hidden))


CASES = {case.name: case for case in _ordered()}
